// Where points were when pairs were looked for, and whether any two that were apart then may touch by now.
//
// A pair is found that is nearer than the points' reaches, each a radius and a slack. Others cannot touch as long as no
// two points have come closer by more than their slacks. What they move by together does not count, and neighbours
// mostly move together, in a fall as in a slide: so ways are measured in frames that move with blocks of space. With
// c the mean way of a block's points, and x the most by which a point's way from that is more than its slack, nothing
// is missed while
//
//   x_a + x_b + |c_a - c_b| <= 0      for blocks that are neighbours, and for each with itself
//   |c_a - c_b| <= edge - 2 reach     for all others, which are a block apart
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

class SearchedPlaces {
public:
    // Points of no radius take no part. Radii are the same until the next call.
    void set(const Substep& now, std::span<const float> radius, float largest, float least);

    // Since then.
    bool outrun(const Substep& now);

    std::span<const Vec3d> places() const { return at_; }
    std::span<const float> reach() const { return reach_; }  // m

    // Blocks are wider than any pair is apart. Block coordinates of a point:
    const std::array<std::int32_t, 3>& block(std::size_t i) const { return block_[i]; }

private:
    void cut_blocks(std::span<const float> radius);

    int lasted_ = 0;             // sub-steps, at the end of which it was outrun
    int in_vain_ = 0;            // searches one after the other that have not lasted
    double edge_ = 0, far_ = 0;  // m: of a block; what blocks that are no neighbours may come closer by
    std::vector<Vec3d> at_;
    std::vector<float> reach_, slack_;  // m
    std::vector<std::array<std::int32_t, 3>> block_;

    // Blocks that are 32 apart along an axis are taken as one.
    static constexpr std::uint32_t across = 32, none = 0xffffffff;
    std::vector<std::uint32_t> home_;                   // the block of each point, in the order in which they occur
    std::vector<std::uint32_t> begin_, points_;         // of each block
    std::vector<std::array<std::uint32_t, 2>> nearby_;  // blocks that are neighbours
    struct Frame {
        Vec3d way = Vec3d::Zero();  // m, the mean of its points
        double excess = 0;          // m, the most that one of them goes beyond its slack
    };
    std::vector<Frame> frames_;
};

}  // namespace rapid

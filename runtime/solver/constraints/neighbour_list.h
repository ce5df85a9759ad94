// A Verlet list: the pairs of points that may touch, with some slack, and whether it is still valid.
//
// A pair is listed that is nearer than the points' reaches, each a radius and a slack. Others cannot touch as long as
// no two points have approached by more than their slacks. A common motion does not count, and neighbours mostly move
// together, in a fall as in a slide: so displacements are measured in frames that move with blocks of space. With c the
// mean displacement of a block's points, and x the most by which a point's displacement from that exceeds its slack,
// the list is valid while
//
//   x_a + x_b + |c_a - c_b| <= 0      for neighbouring blocks, and for each with itself
//   |c_a - c_b| <= edge - 2 reach     for all others, which are a block apart
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_search.h"

namespace rapid {

class NeighbourList {
public:
    // Finds all pairs. Points of radius 0 take no part. Radii stay the same until the next call; grids are theirs.
    void build(const Substep& step, std::span<const float> radius, const RadiusGrids& grids);

    // Whether points may touch by now that are not listed.
    bool expired(const Substep& step);

    const Pairs& pairs() const { return pairs_; }
    std::span<const float> reach() const { return reach_; }  // m, radius and slack

    // Blocks are wider than the points of any pair are apart. Block coordinates of a point:
    const std::array<std::int32_t, 3>& block(std::size_t i) const { return coordinates_[i]; }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(pairs_, age_, short_lived_, edge_, far_, at_, reach_, slack_, coordinates_, block_of_, begin_, points_,
             neighbouring_, frames_);
    }
    // Of a snapshot: whether it is a list of so many points.
    bool is_of(std::size_t points) const;

private:
    void store_positions(const Substep& step, std::span<const float> radius);
    void cut_blocks(std::span<const float> radius);
    void predict_motion(const Substep& step);
    void choose_slack(const Substep& step, std::span<const float> radius);
    void measure_motion(const Substep& step);

    Pairs pairs_;
    ContactSearch search_;

    int age_ = 0;                       // sub-steps
    int short_lived_ = 0;               // lists in a row that have not lasted
    double edge_ = 0, far_ = 0;         // m: of a block; what blocks that are no neighbours may approach by
    std::vector<Vec3d> at_;             // where the points were
    std::vector<float> reach_, slack_;  // m
    std::vector<std::array<std::int32_t, 3>> coordinates_;

    // Blocks that are 32 apart along an axis are taken as one.
    static constexpr std::uint32_t across = 32, none = 0xffffffff;
    std::vector<std::uint32_t> block_of_;                     // each point; blocks in the order in which they occur
    std::vector<std::uint32_t> begin_, points_;               // of each block
    std::vector<std::array<std::uint32_t, 2>> neighbouring_;  // blocks
    struct Frame {
        Vec3d shift = Vec3d::Zero();  // m, the mean of its points
        double excess = 0;            // m, the most that one of them goes beyond its slack

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(shift, excess);
        }
    };
    std::vector<Frame> frames_;  // of the blocks
};

}  // namespace rapid

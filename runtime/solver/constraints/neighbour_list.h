// A Verlet list: pairs of points that may touch, within some slack, and the points for which it is still valid.
//
// A pair is listed if it is closer than the points' reaches, each a radius plus a slack. Other pairs cannot touch
// unless two points approach by more than their slacks. A common motion does not matter, and neighbours mostly move
// together, both in a fall and in a slide. Displacements are therefore measured in frames that move with blocks of
// space. With c the mean displacement of a block's points, and x a point's displacement relative to it, a point is a
// stray once
//
//   |x| + max |c_a - c_b|/2 > slack      over the neighbouring blocks b of its block a
//
// The list holds all pairs that may touch and contain no stray, as long as blocks that are not neighbours satisfy
//
//   |c_a - c_b| <= edge - 2 reach        because they are a block apart
//
// Pairs with strays are found separately, so a few fast points do not force a full search.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

class NeighbourList {
public:
    // Finds all pairs. Points of radius 0 take no part. The radii must not change until the next call; grids are built
    // from them.
    void build(const Substep& step, std::span<const float> radius, const RadiusGrids& grids);

    // Finds the strays. Returns true if the list must be rebuilt, because there are too many or blocks have moved too
    // far.
    bool expired(const Substep& step);

    const Pairs& pairs() const { return pairs_; }
    std::span<const float> reach() const { return reach_; }  // m, radius plus slack

    std::span<const std::uint32_t> strays() const { return strays_; }  // ascending
    bool is_stray(std::size_t i) const { return is_stray_[i] != 0; }

    // Block coordinates of a point. Blocks are wider than the distance of any pair.
    const std::array<std::int32_t, 3>& block(std::size_t i) const { return coordinates_[i]; }
    std::size_t blocks() const { return frames_.size(); }
    std::span<const std::uint32_t> points_of(std::size_t block) const
    {
        return std::span(points_).subspan(begin_[block], begin_[block + 1] - begin_[block]);
    }

    // Blocks processed by a thread in one task.
    static constexpr std::size_t blocks_per_task = 16;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(pairs_, edge_, far_, at_, reach_, slack_, coordinates_, block_of_, begin_, points_, neighbouring_,
             frames_);
    }
    // Returns true if a loaded list is for this number of points.
    bool is_of(std::size_t points) const;

private:
    void store_positions(const Substep& step, std::span<const float> radius);
    void cut_blocks(std::span<const float> radius);
    template <class F>
    void move_frames(const F& displacement);
    void choose_slack(const Substep& step, std::span<const float> radius);
    bool blocks_are_separate() const;
    void find_strays(const Substep& step);

    Pairs pairs_;
    ContactSearch search_;

    double edge_ = 0, far_ = 0;         // m: edge of a block; approach allowed for blocks that are not neighbours
    std::vector<Vec3d> at_;             // positions of the points when the list was built
    std::vector<float> reach_, slack_;  // m
    std::vector<std::array<std::int32_t, 3>> coordinates_;

    // Blocks that are 32 apart along an axis count as the same block.
    static constexpr std::uint32_t across = 32, none = 0xffffffff;
    std::vector<std::uint32_t> block_of_;                     // of each point; blocks in order of occurrence
    std::vector<std::uint32_t> begin_, points_;               // points by block
    std::vector<std::array<std::uint32_t, 2>> neighbouring_;  // pairs of blocks
    struct Frame {
        Vec3d shift = Vec3d::Zero();  // m, the mean displacement of its points
        double separation = 0;        // m, half of the largest difference from a neighbour's shift

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(shift, separation);
        }
    };
    std::vector<Frame> frames_;  // by block

    std::vector<std::uint8_t> is_stray_;
    std::vector<std::uint32_t> strays_;
};

// Pairs of points that a neighbour list no longer covers, because one of them has strayed.
//
// Strays are few: each block of the list searches for those near the box of its other points, and strays are compared
// with each other along x.
class StrayPairs {
public:
    // Finds the unlisted pairs with a stray that are closer than near_contact times the sum of their radii, ascending.
    // Points of radius 0 take no part.
    const std::vector<ContactPair>& find(const Substep& step, std::span<const float> radius, const NeighbourList& list);

private:
    struct Stray {
        Vec3d P;
        std::uint32_t i;
    };
    void sort_strays(const Substep& step, std::span<const float> radius, const NeighbourList& list);
    void find_in_block(std::size_t block, const Substep& step, std::span<const float> radius, const NeighbourList& list,
                       std::vector<ContactPair>& found) const;
    void find_among_strays(std::span<const float> radius);

    std::vector<Stray> strays_;                    // sorted by x
    double largest_ = 0;                           // m, radius of a stray
    std::vector<std::vector<ContactPair>> found_;  // by task
    std::vector<ContactPair> pairs_;
};

}  // namespace rapid

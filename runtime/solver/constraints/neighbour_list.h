// A Verlet list: the pairs of points that may touch, with some slack, and for which points it is still valid.
//
// A pair is listed that is nearer than the points' reaches, each a radius and a slack. Others cannot touch as long as
// no two points have approached by more than their slacks. A common motion does not count, and neighbours mostly move
// together, in a fall as in a slide: so displacements are measured in frames that move with blocks of space. With c the
// mean displacement of a block's points, and x a point's displacement from that, a point is a stray once
//
//   |x| + max |c_a - c_b|/2 > slack      over the neighbouring blocks b of its block a
//
// The list holds all pairs that may touch of which neither is a stray, as long as blocks that are no neighbours have
//
//   |c_a - c_b| <= edge - 2 reach        as they are a block apart
//
// Those of strays are found apart (stray_pairs.h): a few fast points do not cost a search of all.
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

    // Finds the strays. True where there are so many that the list is to be built again, or where blocks have moved too
    // far.
    bool expired(const Substep& step);

    const Pairs& pairs() const { return pairs_; }
    std::span<const float> reach() const { return reach_; }  // m, radius and slack

    std::span<const std::uint32_t> strays() const { return strays_; }  // ascending
    bool is_stray(std::size_t i) const { return is_stray_[i] != 0; }

    // Blocks are wider than the points of any pair are apart. Block coordinates of a point:
    const std::array<std::int32_t, 3>& block(std::size_t i) const { return coordinates_[i]; }
    std::size_t blocks() const { return frames_.size(); }
    std::span<const std::uint32_t> points_of(std::size_t block) const
    {
        return std::span(points_).subspan(begin_[block], begin_[block + 1] - begin_[block]);
    }

    // Blocks whose points are handed to a thread together.
    static constexpr std::size_t blocks_a_task = 16;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(pairs_, edge_, far_, at_, reach_, slack_, coordinates_, block_of_, begin_, points_, neighbouring_,
             frames_);
    }
    // Of a snapshot: whether it is a list of so many points.
    bool is_of(std::size_t points) const;

private:
    void store_positions(const Substep& step, std::span<const float> radius);
    void cut_blocks(std::span<const float> radius);
    template <class F>
    void move_frames(const F& displacement);
    void choose_slack(const Substep& step, std::span<const float> radius);
    bool blocks_stay_apart() const;
    void find_strays(const Substep& step);

    Pairs pairs_;
    ContactSearch search_;

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
        Vec3d shift = Vec3d::Zero();  // m, the mean displacement of its points
        double parting = 0;           // m, half of the most by which that of a neighbour differs

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(shift, parting);
        }
    };
    std::vector<Frame> frames_;  // of the blocks

    std::vector<std::uint8_t> is_stray_;
    std::vector<std::uint32_t> strays_;
};

}  // namespace rapid

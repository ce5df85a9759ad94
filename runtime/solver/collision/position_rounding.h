// Rounds positions to single precision at the end of a frame, on the outer side of the surfaces that points are on.
//
// Rounding to nearest may put a point on the inner side of its surface, by up to half an ulp per axis. The coordinate
// with the largest effect is then moved by the least amount that brings the point out again. A point that has not
// moved keeps its bits, so that nothing creeps.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class PositionRounding {
public:
    PositionRounding(const CollisionBlock& block, const TouchedPoints& touched) : block_(block), touched_(touched) {}

    // Starts a new block.
    void begin()
    {
        initial_P_.resize(block_.size());
        for (auto& side : moved_on_) side.resize(block_.obstacles.size());
    }

    // Is called before rounding. Moves points that have moved on surfaces onto them, to double precision, to remove
    // the error of their paths. initial: positions at the beginning of the frame.
    void snap(std::span<Vec3d> P, std::span<const Vec3f> initial);
    // Is called after rounding. Lifts those points to the outer sides of their surfaces.
    void lift(std::span<Vec3f> rounded);

private:
    void find_moved(std::span<const Vec3d> P, std::span<const Vec3f> initial);
    template <class Position, class Use>
    void query_surfaces(const Position& position, const Use& use);
    double tolerance(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const;

    const CollisionBlock& block_;
    const TouchedPoints& touched_;
    std::vector<Vec3f> initial_P_;

    // Points of the block that have moved on a surface in the frame, by the surface's side of an edge and obstacle,
    // and those that can have touched only one plane.
    std::array<std::vector<std::vector<std::uint32_t>>, 2> moved_on_;
    std::vector<std::uint32_t> moved_on_plane_;
    DistanceQuery query_;
};

}  // namespace rapid

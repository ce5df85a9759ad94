// Points that a shape with the response `stick` holds: whatever pulls them, they move with its surface.
//
// That a point is stuck is not stored: at each sub-step it is found touching the surface, with the surface's velocity.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class StuckPoints {
public:
    StuckPoints(const CollisionBlock& block, TouchedPoints& touched) : block_(block), touched_(touched) {}

    // A new block.
    void begin();
    // Finds the stuck points of a sub-step, and moves them through it.
    void advance();

    bool has(std::size_t i) const { return stuck_[i] != 0; }
    const std::vector<std::uint32_t>& list() const { return list_; }

private:
    void ask_about(const Obstacle& obstacle);
    void carry(std::size_t i, int obstacle, double now);

    const CollisionBlock& block_;
    TouchedPoints& touched_;
    std::vector<std::uint8_t> stuck_;
    std::vector<std::uint32_t> list_;
    DistanceQuery query_;
};

}  // namespace rapid

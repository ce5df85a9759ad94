// The points of a block that have met a shape since the frame began, with the surfaces that they are on.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"

namespace rapid {

class TouchedPoints {
public:
    struct Surface {
        int obstacle = -1;  // -1: no surface
        Vec3d n = Vec3d::Zero();
    };
    using Surfaces = std::array<Surface, 2>;  // two at an edge

    explicit TouchedPoints(const CollisionBlock& block) : block_(block) {}

    // Starts a new block.
    void begin()
    {
        touched_.assign(block_.size(), 0);
        list_.clear();
        surfaces_.resize(block_.size());
        only_plane_.assign(block_.size(), -1);
    }

    void add(std::size_t i)
    {
        if (touched_[i]) return;
        touched_[i] = 1;
        if (block_.context.met) block_.context.met[block_.indices[i]] = 1;
        list_.push_back(static_cast<std::uint32_t>(i));
        surfaces_[i] = {};
    }

    bool has(std::size_t i) const { return touched_[i] != 0; }
    const std::vector<std::uint32_t>& list() const { return list_; }  // in the order of their first contacts

    const Surfaces& surfaces(std::size_t i) const { return surfaces_[i]; }
    void set_surfaces(std::size_t i, const Surfaces& surfaces) { surfaces_[i] = surfaces; }
    void set_surface(std::size_t i, const Surface& surface) { surfaces_[i] = {surface, Surface()}; }

    // Returns the plane if it is the only surface that the point can have touched at the end of the substep; -1 for
    // none.
    int only_plane(std::size_t i) const { return only_plane_[i]; }
    void set_only_plane(std::size_t i, int obstacle) { only_plane_[i] = obstacle; }

private:
    const CollisionBlock& block_;
    std::vector<std::uint8_t> touched_;
    std::vector<std::uint32_t> list_;
    std::vector<Surfaces> surfaces_;
    std::vector<int> only_plane_;
};

}  // namespace rapid

// Points found inside a shape by a path, because they were born there or the shape swept over them, are moved out
// immediately and keep their velocity. If they move inwards, they then meet the surface like any other point.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"

namespace rapid {

// Limit on ejections of a point in one substep before it counts as trapped: outside one shape it may be inside
// another, and an inexact distance field needs a few steps.
constexpr int max_ejections = 64;

class Ejection {
public:
    // A displacement without a velocity.
    struct Displacement {
        std::uint32_t i;
        Vec3d by;  // m
    };

    explicit Ejection(const CollisionBlock& block) : block_(block) {}

    // Starts a new block.
    void begin()
    {
        displacements_.clear();
        lost_.clear();
    }

    // Moves a point out along the shortest known way. path_v: velocity of the path on which the contact was found,
    // which differs from the point's under drag and springs; a: acceleration on the point.
    void eject(CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v, const Vec3d& a);

    // Displaces a point that stays at its new position.
    void displace(std::uint32_t i, const Vec3d& by)
    {
        block_.P[i] += by;
        displacements_.push_back({i, by});
    }

    std::span<const Displacement> displacements() const { return displacements_; }
    // The points that found no way out, possibly more than once.
    const std::vector<std::uint32_t>& lost() const { return lost_; }

private:
    bool move_out(const CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v,
                  const Vec3d& a);

    const CollisionBlock& block_;
    std::vector<Displacement> displacements_;
    std::vector<std::uint32_t> lost_;
};

}  // namespace rapid

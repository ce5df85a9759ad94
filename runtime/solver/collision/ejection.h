// Points that a path finds inside a shape, because they were born there or the shape has swept over them, are taken out
// at once, with the velocity that they have. Moving inwards, they then meet the surface as any other point does.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"

namespace rapid {

// How often a point is taken out of shapes in one sub-step before it counts as trapped: out of one it may be in
// another, and where a field is no exact distance it takes a few steps out of one.
constexpr int max_ejections = 64;

class Ejection {
public:
    // A displacement that is no motion.
    struct Displacement {
        std::uint32_t i;
        Vec3d by;  // m
    };

    explicit Ejection(const CollisionBlock& block) : block_(block) {}

    // A new block.
    void begin()
    {
        displacements_.clear();
        lost_.clear();
    }

    // Along the shortest way out that is known. path_v: the velocity of the path on which the contact was found, which
    // under drag and springs is not the point's; a: the acceleration on the point.
    void eject(CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v, const Vec3d& a);

    // Of a point that stays where it is put.
    void displace(std::uint32_t i, const Vec3d& by)
    {
        block_.P[i] += by;
        displacements_.push_back({i, by});
    }

    std::span<const Displacement> displacements() const { return displacements_; }
    // The points that found no way out; some more than once.
    const std::vector<std::uint32_t>& lost() const { return lost_; }

private:
    bool move_out(const CollidingPoint& point, const Contact& contact, int obstacle, const Vec3d& path_v,
                  const Vec3d& a);

    const CollisionBlock& block_;
    std::vector<Displacement> displacements_;
    std::vector<std::uint32_t> lost_;
};

}  // namespace rapid

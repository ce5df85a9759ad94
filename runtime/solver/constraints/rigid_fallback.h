// The fallback if rods and springs find no solution in a substep: the points that they link move as one rigid body.
//
// From the points' positions at the beginning of the substep,
//
//   x' = x + d,   v' = V + ω × (x - X)
//
// with d the mean displacement of their free motion, X and V the position and velocity of their centre of mass, and ω
// from their angular momentum. Both momenta are conserved, as is the energy stored in rows, because no distance
// changes. All kinetic energy beyond that of the rigid body is lost. The positions do not turn within the substep: with
// the same ω, turned positions would have another angular momentum. Points linked to something that no row moves follow
// it. Points on springs follow the mean motion of the positions or surfaces that the springs attach to.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

struct Drive;

class RigidFallback {
public:
    // Stores the positions at the beginning of the substep and those after free motion.
    void begin(const Substep& step);
    // Moves the given points, which rows link, and discards the rows' result. driver: holds some of them; null if
    // there is none.
    void apply(Substep& step, std::span<const std::uint32_t> points, const Drive* driver) const;

private:
    std::optional<Drive> resting_position(const Substep& step, std::span<const std::uint32_t> points) const;
    void carry(Substep& step, std::span<const std::uint32_t> points, const Drive& driver) const;
    void move(Substep& step, std::span<const std::uint32_t> points) const;
    void place(Substep& step, std::uint32_t i, const Vec3d& P, const Vec3d& v) const;

    std::vector<Vec3d> start_, P_, v_;
};

}  // namespace rapid

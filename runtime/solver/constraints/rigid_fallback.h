// What is left where rods and springs find no solution in a sub-step: the points that they link move as one rigid body.
//
// From where the points are at the beginning of the sub-step,
//
//   x' = x + d,   v' = V + ω × (x - X)
//
// with d the mean displacement of their free motion, X and V their middle and mean velocity by mass, ω that of their
// angular momentum. Both momenta stay; what rows store stays, as no distance changes; of the energy of motion all that
// is not of a rigid body is lost. The body does not turn within the sub-step, which would change one of these. Points
// that are linked to what no row moves go along with that; those that springs draw, with the places or surfaces that
// draw them, by the mean of these.
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
    // Keeps where points begin the sub-step, and where their free motion has taken them.
    void begin(const Substep& step);
    // Moves the points given, which rows link, in place of what these have done. driver: what holds some of them, null
    // where nothing does.
    void apply(Substep& step, std::span<const std::uint32_t> points, const Drive* driver) const;

private:
    std::optional<Drive> resting_place(const Substep& step, std::span<const std::uint32_t> points) const;
    void carry(Substep& step, std::span<const std::uint32_t> points, const Drive& driver) const;
    void move(Substep& step, std::span<const std::uint32_t> points) const;
    void place(Substep& step, std::uint32_t i, const Vec3d& P, const Vec3d& v) const;

    std::vector<Vec3d> start_, P_, v_;
};

}  // namespace rapid

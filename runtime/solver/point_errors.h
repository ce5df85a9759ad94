// Errors about single points: the point, the frame, the problem, and the point's earlier state.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

class PointErrors {
public:
    PointErrors(const PointSet& points, std::int64_t frame) : points_(points), frame_(frame) {}

    const Column<std::int64_t>& ids() const { return points_.id(); }

    // The occasion on which a value was found, as worded in the message.
    struct Occasion {
        const char *verb, *when, *had;
    };
    static constexpr Occasion before_step{"is", "before the step; correct the node before this one", "it has"};
    static constexpr Occasion in_step{"became", "in the step; the frame was not written", "it had"};
    static constexpr Occasion in_substep{
        "became", "in a substep; the frame was not written; use weaker forces or more substeps", "it had"};
    // The point has been overwritten by the result.
    static constexpr Occasion in_step_overwritten{"became", "in the step; the frame was not written", "it has"};

    // Throws Error if P or v of one of the points from `begin` on is not finite; shapes [n].
    void require_finite(std::size_t begin, std::span<const Vec3f> P, std::span<const Vec3f> v,
                        const Occasion& occasion) const;
    // Does the same for a point whose state would be P and v.
    void require_finite(std::size_t i, const Vec3f& P, const Vec3f& v, const Occasion& occasion) const
    {
        if (!P.allFinite() || !v.allFinite()) not_finite(i, P, v, occasion);
    }

    [[noreturn]] void bad_acceleration(std::size_t i, const Vec3d& a) const;
    // Returns the acceleration by a force (N). Throws Error if the mass (kg) is not above 0, or the force is not
    // finite.
    Vec3d acceleration(std::size_t i, const Vec3d& force, float mass) const
    {
        if (force.isZero(0)) return force;
        if (!(mass > 0) || !force.allFinite()) bad_force(i, force, mass);
        return force / mass;
    }
    // Returns the inverse mass, 1/kg. Throws Error if the mass is not above 0.
    double inverse_mass(std::size_t i, float mass) const;

private:
    [[noreturn]] void not_finite(std::size_t i, const Vec3f& P, const Vec3f& v, const Occasion& occasion) const;
    [[noreturn]] void bad_force(std::size_t i, const Vec3d& force, float mass) const;
    std::string name_of(std::size_t i) const;

    const PointSet& points_;
    std::int64_t frame_;
};

}  // namespace rapid

#include "runtime/solver/point_errors.h"

#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/points/point_text.h"

namespace rapid {

void PointErrors::require_finite(std::size_t begin, std::span<const Vec3f> P, std::span<const Vec3f> v,
                                 const Occasion& occasion) const
{
    if (all_finite(P) && all_finite(v)) return;
    for (std::size_t i = 0; i < P.size(); ++i) require_finite(begin + i, P[i], v[i], occasion);
}

void PointErrors::not_finite(std::size_t i, const Vec3f& P, const Vec3f& v, const Occasion& occasion) const
{
    const auto [name, value] = P.allFinite() ? std::pair("v", v) : std::pair("P", P);
    throw Error(fmt::format("{}: {} {} {{{:g}, {:g}, {:g}}} {}; {} {}", name_of(i), name, occasion.verb, value.x(),
                            value.y(), value.z(), occasion.when, occasion.had, text_of_point(points_, i)));
}

void PointErrors::bad_acceleration(std::size_t i, const Vec3d& a) const
{
    throw Error(fmt::format("{}: its acceleration became {{{:g}, {:g}, {:g}}}; the frame was not written; it had {}",
                            name_of(i), a.x(), a.y(), a.z(), text_of_point(points_, i)));
}

void PointErrors::bad_force(std::size_t i, const Vec3d& force, float mass) const
{
    throw Error(
        fmt::format("{}: a force of {{{:g}, {:g}, {:g}}} on a mass of {:g}; the force must be finite and the "
                    "mass above 0",
                    name_of(i), force.x(), force.y(), force.z(), mass));
}

double PointErrors::inverse_mass(std::size_t i, float mass) const
{
    if (!(mass > 0))
        throw Error(
            fmt::format("{}: its mass is {:g}; with constraints it must be above 0 (:pin is for a point that "
                        "they do not move)",
                        name_of(i), mass));
    return 1.0 / mass;
}

std::string PointErrors::name_of(std::size_t i) const
{
    return fmt::format("point {}, frame {}", points_.id()[i], frame_);
}

}  // namespace rapid

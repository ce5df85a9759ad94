#include "runtime/solver/constraints/contact_material.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/points/members.h"

namespace rapid {

ContactMaterial::ContactMaterial(const PointSet& points, const ContactOptions& options, const std::string& group)
{
    const std::size_t n = points.size();
    const Strided<float> radii = radii_of(options.radius, points);
    const Strided<float> friction = options.friction.read(points), bounce = options.bounce.read(points);
    const Strided<std::uint8_t> members = members_of(points, group);
    radius.resize(n);
    root_friction.resize(n);
    restitution.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        radius[i] = members[i] ? radii[i] : 0;
        root_friction[i] = std::sqrt(friction[i]);
        restitution[i] = bounce[i];
        bounces |= bounce[i] > 0;
    }
    if (options.spin) follow_spin(options.rolling.read(points));
}

// Impacts that turn points are solved at their times, even without restitution. This conserves angular momentum.
void ContactMaterial::follow_spin(Strided<float> rolling_friction)
{
    bounces = true;
    rolling.resize(radius.size());
    for (std::size_t i = 0; i < radius.size(); ++i) {
        rolling[i] = rolling_friction[i];
        restitution[i] = std::max(restitution[i], std::numeric_limits<float>::min());
    }
}

}  // namespace rapid

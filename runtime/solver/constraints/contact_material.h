// Per-point contact properties: radius, friction and restitution.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/points/per_point.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct ContactOptions {
    std::optional<PerPoint<float>> radius;  // default: the attribute pscale if present, else 0
    PerPoint<float> bounce{0.0f};           // ε in [0, 1]; a pair uses the larger
    PerPoint<float> friction{0.0f};         // μ >= 0; a pair uses the geometric mean
    std::optional<double> max_difference;   // m, between radii in one grid (contact_search.h)
    int max_grids = 8;
    double mass_scaling = 0;        // at least 0: a point counts as e^mass_scaling times lighter than its support
    bool record = false;            // contact forces (contact_forces.h)
    bool spin = false;              // points turn (spin.h)
    PerPoint<float> rolling{0.0f};  // μ_r >= 0; a pair uses the geometric mean
};

struct ContactMaterial {
    std::vector<float> radius;  // m; 0 for points that take no part
    std::vector<float> root_friction, restitution;
    bool bounces = false;        // some restitution is above 0
    std::vector<float> rolling;  // empty if points do not turn

    ContactMaterial() = default;
    // Throws Error if an attribute is missing.
    ContactMaterial(const PointSet& points, const ContactOptions& options, const std::string& group);

    bool turns() const { return !rolling.empty(); }
    double reach(std::uint32_t i, std::uint32_t j) const { return double(radius[i]) + double(radius[j]); }

private:
    void follow_spin(Strided<float> rolling_friction);
};

}  // namespace rapid

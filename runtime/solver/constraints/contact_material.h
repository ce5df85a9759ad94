// What contacts read of each point: its radius, friction and restitution.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/points/per_point.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct ContactOptions {
    std::optional<PerPoint<float>> radius;  // the attribute pscale where the points have it, else 0
    PerPoint<float> bounce{0.0f};           // ε in [0, 1]; of two points the larger
    PerPoint<float> friction{0.0f};         // μ >= 0; of two points the geometric mean
    std::optional<double> max_difference;   // m, of the radii in a grid (radius_grids.h)
    int max_grids = 8;
    double mass_scaling = 0;        // at least 0: a point counts as e^mass_scaling times lighter than what it stands on
    bool record = false;            // contact forces (contact_forces.h)
    bool spin = false;              // points turn (spin.h)
    PerPoint<float> rolling{0.0f};  // μ_r >= 0; of two points the geometric mean
};

struct ContactMaterial {
    std::vector<float> radius;  // m; 0 of points that take no part
    std::vector<float> root_friction, restitution;
    bool bounces = false;        // some restitution is above 0
    std::vector<float> rolling;  // empty where points do not turn

    ContactMaterial() = default;
    // Error: an attribute is missing.
    ContactMaterial(const PointSet& points, const ContactOptions& options, const std::string& group);

    bool turns() const { return !rolling.empty(); }
    double reach(std::uint32_t i, std::uint32_t j) const { return double(radius[i]) + double(radius[j]); }

private:
    void follow_spin(Strided<float> rolling_friction);
};

}  // namespace rapid

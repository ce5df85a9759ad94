#include "runtime/solver/constraints/pile_substeps.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "runtime/points/per_point.h"

namespace rapid {
namespace {

// The stiffness κ of grains that count as rigid. It is a compromise: a heap of 10,000 grains is 2 degrees flatter than
// with twice as many substeps (docs/numerics.md, Substeps of a pile).
constexpr double rigid = 12;

// The longest path of a grain in a substep, relative to its radius, for 99 % of the grains. The grains that it meets
// must be found before it has passed their middle.
constexpr double longest_path = 0.5, fraction_slower = 0.99;

// Columns do not begin at multiples of a radius, at which stacks often stand.
constexpr double offset = 0.3;

// A grain of a column of space along the acceleration.
struct Grain {
    double x, y, height;  // x, y: index of the column
    std::uint32_t i;

    bool operator<(const Grain& other) const
    {
        return std::tuple(x, y, -height, i) < std::tuple(other.x, other.y, -other.height, other.i);
    }
};

// Returns the largest p r / m of all grains, 1/s². p is the pressure of a grain's own weight on its own cross-section
// or, if loads add up, the pressure under it in a column as wide as the largest grain, whichever is larger.
double largest_load(const PointSet& points, std::span<const float> radii, const Vec3d& acceleration, bool loads_add_up)
{
    const double g = acceleration.norm();
    const Vec3d up = -acceleration.normalized(), across = up.unitOrthogonal(), along = up.cross(across);
    const double width = 2.0 * *std::max_element(radii.begin(), radii.end());
    const Strided<Vec3f> P = points.P().read();
    const Strided<float> mass = masses_of(points);
    double worst = 0;
    std::vector<Grain> grains;
    for (std::uint32_t i = 0; i < radii.size(); ++i) {
        if (!(radii[i] > 0) || !P[i].allFinite() || !(mass[i] > 0) || !std::isfinite(mass[i])) continue;
        worst = std::max(worst, g / (4.0 * radii[i]));
        if (!loads_add_up) continue;
        const Vec3d at = P[i].cast<double>();
        grains.push_back(
            {std::floor(at.dot(across) / width + offset), std::floor(at.dot(along) / width + offset), at.dot(up), i});
    }
    tbb::parallel_sort(grains.begin(), grains.end());
    double pressure = 0;
    for (std::size_t k = 0; k < grains.size(); ++k) {
        const auto& [x, y, height, i] = grains[k];
        if (k == 0 || x != grains[k - 1].x || y != grains[k - 1].y) pressure = 0;
        pressure += mass[i] * g / (width * width);
        worst = std::max(worst, pressure * radii[i] / mass[i]);
    }
    return worst;
}

// Returns the speed, in radii per second, that 99 % of the grains do not exceed.
double common_speed(const PointSet& points, std::span<const float> radii)
{
    const Strided<Vec3f> v = points.v().read();
    std::vector<double> speeds;
    for (std::size_t i = 0; i < radii.size(); ++i)
        if (radii[i] > 0 && v[i].allFinite()) speeds.push_back(v[i].cast<double>().norm() / radii[i]);
    if (speeds.empty()) return 0;
    const auto slower = static_cast<std::ptrdiff_t>(fraction_slower * static_cast<double>(speeds.size()));
    std::nth_element(speeds.begin(), speeds.begin() + slower, speeds.end());
    return speeds[static_cast<std::size_t>(slower)];
}

}  // namespace

double pile_substeps(const PointSet& points, std::span<const float> radii, const Vec3d& acceleration, double h,
                     bool loads_add_up)
{
    if (radii.empty() || !(*std::max_element(radii.begin(), radii.end()) > 0)) return 1;
    const double g = acceleration.norm();
    const double load = g > 0 && std::isfinite(g) ? largest_load(points, radii, acceleration, loads_add_up) : 0;
    return std::max({1.0, h * std::sqrt(4 * rigid * load), h * common_speed(points, radii) / longest_path});
}

}  // namespace rapid

#include "runtime/solver/estimate/resolution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rapid {
namespace {

constexpr std::size_t max_points = 1000;
constexpr double coarse = 1e-3;  // m: a spacing of a millimetre is visible
constexpr double fine = 1e-5;    // m: losing motion below this spacing is not visible

}  // namespace

double spacing_at(float x)
{
    const float size = std::abs(x);
    return double(std::nextafter(size, std::numeric_limits<float>::infinity())) - double(size);
}

Resolution resolution_of(const PointSet& points, double h)
{
    Resolution found;
    found.h = h;
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    for (std::size_t i = 0; i < points.size(); i += points.size() / max_points + 1) {
        const float largest = P[i].cwiseAbs().maxCoeff();
        if (!std::isfinite(largest)) continue;
        found.coordinate = std::max(found.coordinate, double(largest));
        bool moves = false, is_lost = true;
        for (int axis = 0; axis < 3; ++axis) {
            const double displacement = h * std::abs(double(v[i][axis])), spacing = spacing_at(P[i][axis]);
            moves |= displacement > 0;
            is_lost &= displacement == 0 || (spacing > fine && displacement < 0.5 * spacing);
        }
        found.loses_motion |= moves && is_lost;
    }
    found.spacing = spacing_at(static_cast<float>(found.coordinate));
    return found;
}

Resolution coarser(const Resolution& a, const Resolution& b)
{
    Resolution worse = a.spacing > b.spacing ? a : b;
    worse.loses_motion = a.loses_motion || b.loses_motion;
    return worse;
}

std::string text_of(const Resolution& resolution)
{
    if (!resolution.loses_motion && resolution.spacing < coarse) return {};
    return fmt::format(
        "rounding positions at {:.3g} m are {:.1e} m apart in single precision, so motion below {:.1e} m/s is lost "
        "there; move the scene nearer to the origin\n",
        resolution.coordinate, resolution.spacing, 0.5 * resolution.spacing / resolution.h);
}

}  // namespace rapid

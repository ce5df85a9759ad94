// The path of a point through a step: a parabola, and tolerances for its rounding.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/math/path_extent.h"
#include "runtime/math/vec.h"

namespace rapid {

// x(s) = P + v s + a s²/2 for s in [0, duration], in seconds.
struct Path {
    Vec3d P, v, a;
    double duration;
    double radius;     // m; the path is in contact if distance = radius
    double begin = 0;  // s since the beginning of the frame, for shapes that move during it

    Vec3d at(double s) const { return P + s * (v + 0.5 * s * a); }
    Vec3d velocity(double s) const { return v + s * a; }
};

// Returns the height, m, up to which a point is flush with the surface: the rounding of its position to single
// precision (ulp(x) is at most 2^-23 |x|, half of it per axis), plus the field's own error. The next frame must find a
// point that a frame left on the surface still there. With a smaller tolerance resting points would sometimes count as
// sunken.
inline double flush_within(const Vec3d& P, double radius, double rounding)
{
    return 0x1p-22 * (P.cwiseAbs().maxCoeff() + radius) + rounding;
}

// Returns how near to the surface a walk along the path ends, in units of `scale` m. `rounding` is in the same units.
inline double touching_within(const Path& path, double rounding, double scale = 1)
{
    return std::max(0x1p-50 * (path.P.cwiseAbs().maxCoeff() + path.radius) / scale, rounding / 16);
}

// Returns true if the inward normal component vn of a velocity is within the rounding of a tangential velocity. Without
// this test a sliding point could collide with its own floor again and again, and get nowhere.
inline bool is_along(double vn, const Vec3d& v) { return vn < 0 && vn * vn < 0x1p-96 * v.squaredNorm(); }

// Returns the unit normal of a gradient, or the direction against the velocity if the gradient is zero.
inline Vec3d unit_normal(const Vec3d& gradient, const Vec3d& v)
{
    const double size = gradient.norm();
    if (size > 0) return gradient / size;
    const double speed = v.norm();
    return speed > 0 ? Vec3d(-v / speed) : Vec3d(Vec3d::UnitY());
}

// Returns the first s >= 0 at which f + vn s + an s²/2 changes from positive to negative, for f >= 0; infinite if it
// never does. Uses the form of the root without cancellation.
inline double first_fall_through(double f, double vn, double an)
{
    constexpr double never = std::numeric_limits<double>::infinity();
    const double discriminant = vn * vn - 2 * an * f;
    if (an >= 0) {
        if (vn >= 0 || discriminant < 0) return never;
        return 2 * f / (std::sqrt(discriminant) - vn);
    }
    const double root = std::sqrt(discriminant);
    return vn > 0 ? (vn + root) / -an : 2 * f / (root - vn);
}

// Returns the time in which a point with this speed and acceleration can travel a distance: the root of distance =
// speed s + acceleration s²/2, without cancellation. Infinite for a point at rest.
inline double time_to_travel(double distance, double speed, double acceleration)
{
    const double sum = speed + std::sqrt(speed * speed + 2 * acceleration * distance);
    return sum > 0 ? 2 * distance / sum : std::numeric_limits<double>::infinity();
}

// Returns true if a path from P to `end` can touch the box.
inline bool may_reach(const Vec3d& P, const Vec3d& end, const Vec3d& a, double duration, double radius,
                      const Box3d& bounds)
{
    const double sagging = duration * duration / 8;
    const Box3d box = widened(bounds, radius);
    bool may = true;
    for (int k = 0; k < 3; ++k) {
        const auto extent = PathExtent<double>::of(P[k], end[k], sagging * std::abs(a[k]));
        may &= !extent.misses(box.min()[k], box.max()[k]);
    }
    return may;
}
inline bool may_reach(const Path& path, const Box3d& bounds)
{
    return may_reach(path.P, path.at(path.duration), path.a, path.duration, path.radius, bounds);
}

// Returns true if a point with speed vn out of the plane, m/s, and acceleration g into it, m/s², rises by less than
// rounding (`flush`, m) and is back within the time T. A point that is still off the plane after T leaves it, because
// the cause of its rise may act again before it has fallen back.
inline bool stays_on_plane(double vn, double g, double flush, double T)
{
    return g > 0 && vn * vn <= 2 * g * flush && 2 * vn <= g * T;
}

}  // namespace rapid

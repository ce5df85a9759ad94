#include "runtime/solver/collision/plane_pass.h"

#include <algorithm>
#include <cmath>

#include "runtime/shapes/first_contact.h"

namespace rapid {
namespace {

double dot(double ax, double ay, double az, double bx, double by, double bz) { return ax * bx + ay * by + az * bz; }

double size_of(double x, double y, double z) { return std::sqrt(dot(x, y, z, x, y, z)); }

// flush_within() of a shape without error of its own.
double flush(double x, double y, double z, double radius)
{
    return 0x1p-22 * (std::max(std::max(std::abs(x), std::abs(y)), std::abs(z)) + radius);
}

}  // namespace

void PlanePass::add(std::uint32_t i, const Vec3d& P, const Vec3d& v, const Vec3d& a, double dt, double radius,
                    double bounce, double friction)
{
    const std::size_t j = size++;
    place[j] = i;
    for (int axis = 0; axis < 3; ++axis) {
        P_[axis][j] = P[axis];
        v_[axis][j] = v[axis];
        a_[axis][j] = a[axis];
    }
    dt_[j] = dt;
    radius_[j] = radius;
    bounce_[j] = bounce;
    friction_[j] = friction;
}

void PlanePass::solve(const HalfSpace& plane)
{
    const double nx = plane.n.x(), ny = plane.n.y(), nz = plane.n.z(), offset = plane.offset;
    for (std::size_t j = 0; j < size; ++j) {
        const double x = P_[0][j], y = P_[1][j], z = P_[2][j];
        const double vx = v_[0][j], vy = v_[1][j], vz = v_[2][j];
        const double ax = a_[0][j], ay = a_[1][j], az = a_[2][j];
        const double dt = dt_[j], radius = radius_[j], bounce = bounce_[j], friction = friction_[j];

        const double f = dot(nx, ny, nz, x, y, z) - offset - radius;
        const double vn = dot(nx, ny, nz, vx, vy, vz), g = -dot(nx, ny, nz, ax, ay, az);
        const double near = flush(x, y, z, radius);
        const bool is_over = (g > 0) & (f >= -near), flush_with_it = f <= near;
        const bool stays_above = !flush_with_it & (f + dt * (vn - 0.5 * dt * g) > 0);

        // Along it, slowed by friction. A last approach by less than rounding costs its friction too, as every contact
        // does.
        const bool rests = flush_with_it & (vn * vn <= 2 * g * near);
        const bool only_pressed = (ax + g * nx == 0) & (ay + g * ny == 0) & (az + g * nz == 0);
        const double tx = vx - vn * nx, ty = vy - vn * ny, tz = vz - vn * nz;
        const double slid = size_of(tx, ty, tz), slowing = friction * g;
        const double speed = std::max(0.0, slid - friction * std::max(0.0, -vn));
        const bool stops = speed <= slowing * dt;
        const double way = stops ? 0.5 * speed * speed / slowing : dt * (speed - 0.5 * slowing * dt);
        const double along = speed > 0 ? way / slid : 0, of_slide = (speed - slowing * dt) / slid;

        // One bounce, from where the parabola first goes through it.
        const bool touches = flush_with_it & (vn < 0);
        const double above = std::max(f, 0.0), root = std::sqrt(vn * vn + 2 * g * above);
        const double fall = vn > 0 ? (vn + root) / g : 2 * above / (root - vn);
        const double s = touches ? 0 : fall, rest = dt - s;
        const double bx = x + s * (vx + 0.5 * s * ax), by = y + s * (vy + 0.5 * s * ay),
                     bz = z + s * (vz + 0.5 * s * az);
        const double ux = vx + s * ax, uy = vy + s * ay, uz = vz + s * az;
        const double closing = -dot(nx, ny, nz, ux, uy, uz), rebound = bounce * closing;
        const double rising2 = 2 * g * flush(bx, by, bz, radius);  // of a speed that lifts by less than rounding
        const bool is_single = (closing * closing > rising2) & (rebound * rebound > rising2) & (2 * rebound > g * rest);
        // contact_response()
        const double sx = ux + closing * nx, sy = uy + closing * ny, sz = uz + closing * nz;
        const double slide = size_of(sx, sy, sz), lost = friction * (1 + bounce) * closing;
        const double kept = slide > lost ? 1 - lost / slide : 0;
        const double lx = kept * sx + rebound * nx, ly = kept * sy + rebound * ny, lz = kept * sz + rebound * nz;

        const bool comes_to_it = rest > 0;
        const bool misses = is_over & (stays_above | (!rests & !comes_to_it & !touches));
        const bool lies = is_over & !misses & rests & only_pressed;
        const bool bounces = is_over & !misses & !rests & comes_to_it & is_single;
        kind[j] = misses ? Misses : lies ? Lies : bounces ? Bounces : More;
        left[j] = rest;
        approach[j] = closing;
        end_[0][j] = lies ? x + along * tx : bx + rest * (lx + 0.5 * rest * ax);
        end_[1][j] = lies ? y + along * ty : by + rest * (ly + 0.5 * rest * ay);
        end_[2][j] = lies ? z + along * tz : bz + rest * (lz + 0.5 * rest * az);
        v_end_[0][j] = lies ? (stops ? 0 : of_slide * tx) : lx + rest * ax;
        v_end_[1][j] = lies ? (stops ? 0 : of_slide * ty) : ly + rest * ay;
        v_end_[2][j] = lies ? (stops ? 0 : of_slide * tz) : lz + rest * az;
        from_[0][j] = lies ? x : bx;
        from_[1][j] = lies ? y : by;
        from_[2][j] = lies ? z : bz;
        const double sagging = lies ? 0 : 0.125 * rest * rest;
        sagging_[0][j] = sagging * std::abs(ax);
        sagging_[1][j] = sagging * std::abs(ay);
        sagging_[2][j] = sagging * std::abs(az);
        change_[0][j] = lx - ux;
        change_[1][j] = ly - uy;
        change_[2][j] = lz - uz;
    }
}

// may_reach(), of all ways.
void PlanePass::leave_out_near(const Box3d& box, double radius)
{
    const Vec3d least = box.min(), most = box.max();
    std::int64_t far[many] = {};
    for (int axis = 0; axis < 3; ++axis) {
        const double lowest = least[axis] - radius, highest = most[axis] + radius;
        const double *from = from_[axis], *end = end_[axis], *sagging = sagging_[axis];
        for (std::size_t j = 0; j < size; ++j) {
            const double margin = sagging[j] + 0x1p-21 * (std::abs(from[j]) + radius);
            const bool below = std::max(from[j], end[j]) < lowest - margin;
            const bool above = std::min(from[j], end[j]) > highest + margin;
            far[j] |= below | above;
        }
    }
    for (std::size_t j = 0; j < size; ++j) kind[j] = (kind[j] == Misses) | (far[j] != 0) ? kind[j] : More;
}

}  // namespace rapid

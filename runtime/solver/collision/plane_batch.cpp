#include "runtime/solver/collision/plane_batch.h"

#include <algorithm>
#include <cmath>

#include "runtime/path_extent.h"
#include "runtime/shapes/first_contact.h"

namespace rapid {
namespace {

// A vector of scalars. Operations on Vec3d would not be vectorized over the points of a batch.
struct Triple {
    double x, y, z;
};
Triple operator+(const Triple& a, const Triple& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Triple operator-(const Triple& a, const Triple& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Triple operator*(double s, const Triple& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Triple& a, const Triple& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double norm(const Triple& a) { return std::sqrt(dot(a, a)); }
bool is_zero(const Triple& a) { return (a.x == 0) & (a.y == 0) & (a.z == 0); }
Triple select(bool first, const Triple& a, const Triple& b)
{
    return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}

using Rows = double[3][PlaneBatch::capacity];
Triple load(const Rows& rows, std::size_t j) { return {rows[0][j], rows[1][j], rows[2][j]}; }
void store(Rows& rows, std::size_t j, const Triple& a) { rows[0][j] = a.x, rows[1][j] = a.y, rows[2][j] = a.z; }

// Equals flush_within() for a shape without an error of its own.
double contact_tolerance(const Triple& P, double radius)
{
    return 0x1p-22 * (std::max(std::max(std::abs(P.x), std::abs(P.y)), std::abs(P.z)) + radius);
}

struct State {
    Triple P, v;
};

// Slides along the plane, slowed by friction. A last approach by less than rounding also has its friction, like every
// contact. vn: along the normal n; g: the acceleration into the plane.
State slide(const State& from, const Triple& n, double vn, double g, double friction, double dt)
{
    const Triple vt = from.v - vn * n;
    const double initial = norm(vt), slowing = friction * g;
    const double speed = std::max(0.0, initial - friction * std::max(0.0, -vn));
    const bool stops = speed <= slowing * dt;
    const double distance = stops ? 0.5 * speed * speed / slowing : dt * (speed - 0.5 * slowing * dt);
    const double along = speed > 0 ? distance / initial : 0, kept = (speed - slowing * dt) / initial;
    return {from.P + along * vt, select(stops, {0, 0, 0}, kept * vt)};
}

// Equals contact_response() with a plane at rest. closing: speed of approach.
Triple respond(const Triple& v, const Triple& n, double closing, double rebound, double bounce, double friction)
{
    const Triple vt = v + closing * n;
    const double slide = norm(vt), lost = friction * (1 + bounce) * closing;
    const double kept = slide > lost ? 1 - lost / slide : 0;
    return kept * vt + rebound * n;
}

}  // namespace

void PlaneBatch::solve(const HalfSpace& plane)
{
    const Triple n{plane.n.x(), plane.n.y(), plane.n.z()};
    const double offset = plane.offset;
    for (std::size_t j = 0; j < size_; ++j) {
        const Triple P = load(P_, j), v = load(v_, j), a = load(a_, j);
        const double dt = dt_[j], radius = radius_[j], bounce = bounce_[j], friction = friction_[j];

        const double f = dot(n, P) - offset - radius;
        const double vn = dot(n, v), g = -dot(n, a), tolerance = contact_tolerance(P, radius);
        const bool is_over = (g > 0) & (f >= -tolerance), touches = f <= tolerance;
        const bool stays_above = !touches & (f + dt * (vn - 0.5 * dt * g) > 0);
        const bool rests = touches & (vn * vn <= 2 * g * tolerance) & (2 * vn <= g * dt);  // stays_on_plane()
        const bool only_pressed = is_zero(a + g * n);
        const State slid = slide({P, v}, n, vn, g, friction, dt);

        // One bounce, from the first crossing of the parabola with the plane.
        const bool sinks = touches & (vn < 0);
        const double above = std::max(f, 0.0), root = std::sqrt(vn * vn + 2 * g * above);
        const double fall = vn > 0 ? (vn + root) / g : 2 * above / (root - vn);
        const double s = sinks ? 0 : fall, left = dt - s;
        const Triple at = P + s * (v + 0.5 * s * a), u = v + s * a;
        const double closing = -dot(n, u), rebound = bounce * closing;
        const double rising2 = 2 * g * contact_tolerance(at, radius);  // for a speed that lifts by less than rounding
        const bool is_single = (closing * closing > rising2) & (rebound * rebound > rising2) & (2 * rebound > g * left);
        const Triple after = respond(u, n, closing, rebound, bounce, friction);

        const bool comes_to_it = left > 0;
        const bool misses = is_over & (stays_above | (!rests & !comes_to_it & !sinks));
        const bool slides = is_over & !misses & rests & only_pressed;
        const bool bounces = is_over & !misses & !rests & comes_to_it & is_single;
        outcome_[j] = misses ? Misses : slides ? Slides : bounces ? Bounces : Undecided;
        left_[j] = left;
        approach_[j] = closing;
        store(end_, j, select(slides, slid.P, at + left * (after + 0.5 * left * a)));
        store(v_end_, j, select(slides, slid.v, after + left * a));
        store(contact_, j, select(slides, P, at));
        store(change_, j, after - u);
        const double sagging = slides ? 0 : 0.125 * left * left;
        store(sagging_, j, sagging * Triple{std::abs(a.x), std::abs(a.y), std::abs(a.z)});
    }
}

// Applies may_reach() to all paths.
void PlaneBatch::leave_out_near(const Box3d& box, double radius)
{
    const Box3d wide = widened(box, radius);
    std::int64_t far[capacity] = {};
    for (int axis = 0; axis < 3; ++axis) {
        const double lowest = wide.min()[axis], highest = wide.max()[axis];
        const double *from = contact_[axis], *end = end_[axis], *sagging = sagging_[axis];
        for (std::size_t j = 0; j < size_; ++j)
            far[j] |= PathExtent<double>::of(from[j], end[j], sagging[j]).misses(lowest, highest);
    }
    for (std::size_t j = 0; j < size_; ++j)
        outcome_[j] = ((outcome_[j] == Misses) | (far[j] != 0)) ? outcome_[j] : Undecided;
}

}  // namespace rapid

#include "runtime/solver/collision/plane_contacts.h"

#include <algorithm>
#include <cmath>

#include "runtime/math/path_extent.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/path.h"
#include "runtime/solver/collision/obstacle.h"

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
void PlaneBatch::mark_undecided_near(const Box3d& box, double radius)
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

void PlaneContacts::finish(std::size_t o)
{
    if (batch_.size() == 0) return;
    batch_.solve(*block_.obstacles[o].plane);
    for (std::size_t other = 0; other < block_.obstacles.size(); ++other)
        if (other != o && block_.obstacles[other].is_continuous())
            batch_.mark_undecided_near(block_.obstacles[other].bounds, broad_phase_.largest_radius(other));
    for (std::size_t j = 0; j < batch_.size(); ++j) take(j, o);
    batch_.clear();
}

// Stores the result of one point of the batch.
void PlaneContacts::take(std::size_t j, std::size_t o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::uint32_t i = batch_.point(j);
    const PlaneBatch::Outcome outcome = batch_.outcome(j);
    const bool responds = obstacle.response == Response::Bounce || obstacle.response == Response::Slide;
    if (outcome == PlaneBatch::Undecided || (outcome != PlaneBatch::Misses && !responds)) {
        touched_.set_only_plane(i, -1);
        contacts_.add(i, motion_.path(i, block_.radius(obstacle, i)));
        return;
    }
    const int plane = static_cast<int>(o);
    touched_.set_only_plane(i, corrects_positions_ ? -1 : plane);
    if (outcome == PlaneBatch::Misses) return;
    motion_.paths().end_with(i, batch_.end(j), batch_.velocity(j));
    touched_.add(i);
    const Vec3d n = obstacle.plane->n;
    if (outcome == PlaneBatch::Bounces)
        audit_.add(i, plane,
                   {batch_.contact(j), n, Vec3d::Zero(), batch_.approach(j),
                    motion_.velocity_after(i, block_.dt[i] - batch_.left(j)), batch_.change(j),
                    block_.time(i, batch_.left(j))});
    else
        touched_.set_surface(i, {plane, n});
}

bool PlaneContacts::slides_on_plane(std::size_t i)
{
    const Contact& contact = contacts_.contact(i);
    if (!contact.flat || contact.time > 0 || contact.depth > 0) return false;
    const int o = contacts_.obstacle(i);
    const Obstacle& obstacle = block_.obstacles[o];
    const Vec3d &P = block_.P[i], &v = block_.v[i];
    if (motion_.longest_parabola(i, block_.dt[i]) < block_.dt[i]) return false;
    if (obstacle.response == Response::Stick || obstacle.response == Response::Die || obstacle.clings()) return false;
    if (!obstacle.acceleration_at(P, v, block_.frame_time(i, block_.dt[i])).isZero(0)) return false;
    const double g = -motion_.acceleration(i).dot(contact.n), vn = (v - contact.vc).dot(contact.n);
    if (!stays_on_plane(vn, g, obstacle.contact_tolerance(P, block_.radius(obstacle, i)), block_.dt[i])) return false;

    const Support on{o, contact.n, contact.vc, 0, obstacle.friction[block_.indices[i]], true, obstacle.feature};
    if (!slide_on_plane(i, on)) return false;
    touched_.set_surface(i, {o, on.n});
    return true;
}

bool PlaneContacts::slide_on_plane(std::size_t i, const Support& on)
{
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const Vec3d& a = motion_.acceleration(i);
    const double dt = block_.dt[i];
    const Vec3d along = tangential_to(on, contact_response(v, on.vc, on.n, 0, on.friction));
    const Slide slide = slide_on(on, along, a, dt, min_turning_piece * dt);
    if (slide.kind == Slide::Leaves) return false;
    if (slide.kind == Slide::Sticks) {
        v = on.vc;
        P += dt * on.vc;
        return true;
    }
    const double left = dt - slide.duration;
    if (left > 0 && !(slide.stops && slide_on(on, on.vc, a, left, 0).kind == Slide::Sticks)) return false;
    const Path path{P, along, slide.a, slide.duration, 0};
    if (may_meet_another(i, path, on.collider)) return false;
    P = path.at(path.duration) + left * on.vc;
    v = slide.stops ? on.vc : Vec3d(path.v + path.duration * path.a);
    return true;
}

bool PlaneContacts::may_meet_another(std::size_t i, const Path& path, int obstacle) const
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (static_cast<int>(o) != obstacle && block_.may_reach_obstacle(i, path, o)) return true;
    return false;
}

}  // namespace rapid

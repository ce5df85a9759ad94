#include "runtime/solver/collision/path_planner.h"

#include <algorithm>
#include <utility>

#include "runtime/shapes/first_contact.h"

namespace rapid {
namespace {

// A point that has not moved, within rounding, in this many contacts and pieces is at rest. In a pit of a field it may
// chatter at 1e-10 m/s between facets each of which would let it slide. Real impacts move a point farther.
constexpr int chatter_events = 1024;

// The longest piece along the edge of curved surfaces, relative to the substep.
constexpr double max_edge_piece = 1.0 / 16;

}  // namespace

bool PathPlanner::plan(CollidingPoint& point)
{
    const std::size_t i = point.i;
    while (point.left > 0) {
        const double duration = motion_.longest_parabola(i, point.left);
        if (motion_.is_damped()) point.by_forces.advance(block_.P[i], motion_.acceleration(i));
        motion_.update_acceleration(i, duration);
        point.path = {block_.P[i], block_.v[i], motion_.acceleration(i), duration, 0};
        point.kind = CollidingPoint::Free;
        point.stops = false;
        if (point.supports == 0) return true;
        if (chatters(point)) return ride(point), false;
        const Slide next = slide(point);
        if (next.kind == Slide::Leaves) continue;
        if (next.kind == Slide::Sticks) return ride(point), false;
        return slide_along_surface(point, next);
    }
    return false;
}

// Slides along the supports. A surface that the point leaves no longer supports it.
Slide PathPlanner::slide(CollidingPoint& point)
{
    const Vec3d &v = block_.v[point.i], &a = motion_.acceleration(point.i);
    if (point.supports == 1) {
        const Slide next = slide_on(point.on[0], v, a, point.path.duration, min_turning_piece * block_.dt[point.i]);
        if (next.kind == Slide::Leaves) point.supports = 0;
        return next;
    }
    int lifted = -1;
    const Slide next = slide_along(point.on[0], point.on[1], v, a, point.path.duration, lifted);
    if (next.kind == Slide::Leaves) {
        if (lifted == 0) point.on[0] = point.on[1];
        point.supports = 1;
    }
    return next;
}

bool PathPlanner::slide_along_surface(CollidingPoint& point, const Slide& slide)
{
    Path& path = point.path;
    path.a = slide.a;
    path.duration = slide.duration;
    point.stops = slide.stops;
    if (point.is_on_flat()) {
        point.kind = CollidingPoint::Straight;
        slow_down(point);
        path.a += point.on[0].ac;
        return true;
    }
    if (point.supports == 1) {
        point.kind = CollidingPoint::Curved;  // in the surface's frame, to the end of the piece
        point.limit_path(point.piece);
    } else {
        // Along the edge of curved surfaces in short straight pieces. Each ends in the air, or within rounding of the
        // surfaces, and the next contact finds it there.
        point.kind = CollidingPoint::Straight;
        double longest = max_edge_piece * block_.dt[point.i];
        if (const double feature = std::max(point.on[0].feature, point.on[1].feature); feature > 0)
            longest = std::min(longest, time_to_travel(feature, path.v.norm(), path.a.norm()));
        point.limit_path(longest);
        slow_down(point);
        path.a += point.on[0].ac;
    }
    if (++point.events < max_contacts) return true;
    audit_.add_limited();
    return false;
}

// Slows the path by the viscosity of the supports.
void PathPlanner::slow_down(CollidingPoint& point) const
{
    const double k = point.on[0].viscosity + (point.supports == 2 ? point.on[1].viscosity : 0);
    if (!(k > 0)) return;
    Path& path = point.path;
    const Parabola slowed = relaxed(path.v - point.on[0].vc, path.a, k, path.duration);
    path.v = point.on[0].vc + slowed.v;
    path.a = slowed.a;
}

// Returns true if a point on a surface has had many events without moving in the surface's frame. On a moving surface,
// it moves along.
bool PathPlanner::chatters(CollidingPoint& point) const
{
    if (point.events < point.checked_events + chatter_events) return false;
    point.checked_events = point.events;
    const Vec3d& P = block_.P[point.i];
    const Vec3d before = std::exchange(point.checked_P, P);
    const Obstacle& obstacle = block_.obstacles[point.on[0].collider];
    return (P - before).norm() <= obstacle.contact_tolerance(P, block_.radius(obstacle, point.i));
}

// Moves the point with the surface for the rest of the substep.
void PathPlanner::ride(CollidingPoint& point)
{
    const Support& on = point.on[0];
    Vec3d &P = block_.P[point.i], &v = block_.v[point.i];
    if (const MovingBody* body = block_.obstacles[on.collider].body) {
        const double now = block_.frame_time(point.i, point.left);
        const MovingBody::State there = body->follow(body->material_at(P, now), now + point.left);
        P = there.P, v = there.v;
        return;
    }
    P += point.left * (on.vc + 0.5 * point.left * on.ac);
    v = on.vc + point.left * on.ac;
}

void PathPlanner::finish_path(CollidingPoint& point)
{
    Vec3d &P = block_.P[point.i], &v = block_.v[point.i];
    const Path& path = point.path;
    Support& on = point.on[0];
    if (point.kind == CollidingPoint::Curved) {
        P = point.end.P;
        v = point.end.v;
        on.n = point.end.n;
        on.curvature = point.end.curvature;
    } else {
        P = path.at(path.duration);
        v = path.v + path.duration * path.a;
    }
    point.left -= path.duration;
    if (point.supports > 0 && !on.ac.isZero(0)) {
        const Obstacle& obstacle = block_.obstacles[on.collider];
        const double now = block_.frame_time(point.i, point.left);
        on.vc = obstacle.shape->velocity_at(P, now);
        if (point.kind == CollidingPoint::Curved) v = tangential_to(on, v);
        on.ac = obstacle.acceleration_at(P, point.stops ? on.vc : v, now);
    }
    if (point.stops) v = on.vc;
    // A point that adheres to the surfaces of an edge stays on the first.
    if (point.supports == 2 && !point.is_on_flat()) point.supports = on.adhesion > 0 ? 1 : 0;
}

}  // namespace rapid

#include "runtime/solver/collision/contact_rounds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/shapes/first_contact.h"
#include "runtime/solver/motion/damped_motion.h"

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
        if (chatters(point)) return move_with_surface(point), false;
        const Slide next = slide(point);
        if (next.kind == Slide::Leaves) continue;
        if (next.kind == Slide::Sticks) return move_with_surface(point), false;
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
void PathPlanner::move_with_surface(CollidingPoint& point)
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

namespace {

// The largest turn of a surface within a piece, as the cosine of 0.2 radians. The length of a path around a circle is
// then accurate to 1e-5 per piece.
constexpr double min_cosine = 0.98;

// A surface that curves inwards with a radius below the field's resolution is a kink, at which a point bounces. Turns
// by less than this angle, in radians, are noise of the field.
constexpr double min_kink = 0.02;

// Returns the shortest piece, s.
double shortest_piece(const Obstacle& obstacle, const Path& path, double dt)
{
    if (!(obstacle.feature > 0)) return min_piece * dt;
    return time_to_travel(obstacle.feature / 64, path.v.norm(), path.a.norm());
}

// Returns the tangential acceleration of a supported point, in the surface's frame.
Vec3d tangential_acceleration(const Slide& slide, const Vec3d& pull, const Vec3d& n)
{
    return slide.kind == Slide::Moves ? slide.a : Vec3d(pull - pull.dot(n) * n);
}

}  // namespace

void CurvedMotion::find_ends(std::span<CollidingPoint> points, std::span<const std::uint32_t> active)
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        begin_pieces(points, active, static_cast<int>(o));
        if (query_.empty()) continue;
        const Obstacle& obstacle = block_.obstacles[o];
        query_.find_gradients_at_times(*obstacle.shape);
        std::size_t kept = 0;
        for (std::size_t j = 0; j < query_.size(); ++j)
            if (follow_arc(points[query_.point[j]], j)) query_.move(j, kept++);
        query_.truncate(kept);
        project(points, obstacle);
        if (!obstacle.moves) query_.find_gradients_at_times(*obstacle.shape);
        for (std::size_t j = 0; j < kept; ++j) end_piece(points[query_.point[j]], j);
        if (obstacle.moves) follow_surface(points, obstacle);
    }
}

// Begins the tangential pieces along one shape, and adds the query for the surface at their ends.
void CurvedMotion::begin_pieces(std::span<CollidingPoint> points, std::span<const std::uint32_t> active, int o)
{
    const double feature = block_.obstacles[o].feature;
    query_.clear();
    for (const std::uint32_t slot : active) {
        CollidingPoint& point = points[slot];
        const Support& on = point.on[0];
        if (point.kind != CollidingPoint::Curved || on.collider != o) continue;
        Path& path = point.path;
        path.v -= on.vc + on.n.dot(path.v - on.vc) * on.n;  // along the surface, in its frame
        // Beyond its smallest feature the field may have anything, such as a wall across the path or an edge.
        if (feature > 0) point.limit_path(time_to_travel(2 * feature, path.v.norm(), path.a.norm()));
        point.slip = path.v, point.drive = path.a;
        if (on.viscosity > 0) {
            const Parabola slowed = relaxed(path.v, path.a, on.viscosity, path.duration);
            path.v = slowed.v, path.a = slowed.a;
        }
        query_.add(slot, path.at(path.duration), block_.frame_time(point.i, point.left));  // in the surface's frame
    }
}

// Bends the piece to the chord of its arc. Returns false if the surface does not let the point go that far.
bool CurvedMotion::follow_arc(CollidingPoint& point, std::size_t j)
{
    const Path& path = point.path;
    const Support& on = point.on[0];
    const Obstacle& obstacle = block_.obstacles[on.collider];
    const Vec3d d = query_.P[j] - path.P, n = on.n;
    const double length = d.norm(), slope = query_.gradient[j].norm();
    const Vec3d n1 = slope > 0 ? Vec3d(query_.gradient[j] / slope) : n;
    const double cosine = n.dot(n1), turn = length > 0 ? (n1 - n).dot(d) / length : 0;
    double curvature = length > 0 ? turn / length : 0;
    // Creases that the field cannot resolve do not throw off an adhering point.
    if (on.adhesion > 0 && obstacle.feature > 0) curvature = std::min(curvature, 1 / obstacle.feature);
    const double shortest = shortest_piece(obstacle, path, block_.dt[point.i]);
    const bool leaves =
        -(motion_.acceleration(point.i) - on.ac).dot(n) - curvature * path.v.squaredNorm() < -on.adhesion;
    const bool kink = turn < -min_kink && -curvature * 2 * obstacle.feature > 1;
    if (path.duration > shortest && (cosine < min_cosine || leaves || kink || !(slope > 0)))
        return wait_for(point, shortest), false;
    if (leaves) return leave_surface(point), false;
    if (turn < 0 && (kink || cosine < min_cosine)) return meet_kink(point, n1), false;

    const Vec3d tangent = length > 0 ? Vec3d(d / length) : Vec3d(Vec3d::Zero());
    const Vec3d tangent1 = transported(tangent, n, n1);
    const Vec3d middle = tangent + tangent1;
    const double angle2 = 2 * (1 - std::min(1.0, cosine));
    point.end.curvature = curvature;
    query_.P[j] = path.P + length * (1 - angle2 / 24) * (length > 0 ? middle.normalized() : middle);
    return true;
}

// Postpones the piece to the next round, with a shorter length.
void CurvedMotion::wait_for(CollidingPoint& point, double shortest) const
{
    point.piece = std::max(point.path.duration / 4, shortest);
    point.kind = CollidingPoint::Waits;
}

// Moves the point a little along its path. At an edge the surface may seem to curve less at the point than along its
// path, and would otherwise be met again immediately.
void CurvedMotion::leave_surface(CollidingPoint& point) const
{
    Vec3d &P = block_.P[point.i], &v = block_.v[point.i];
    const Vec3d& a = motion_.acceleration(point.i);
    const double dt = block_.dt[point.i];
    const double moment = std::min(point.left, std::max(point.path.duration, min_piece * dt));
    P += moment * (v + 0.5 * moment * a);
    v += moment * a;
    point.left -= moment;
    point.supports = 0;
    point.piece = dt;
    point.kind = CollidingPoint::Free;
    point.path = {P, v, a, point.left, point.path.radius};
}

// Handles a surface that turns up in front of the point, with the normal n.
void CurvedMotion::meet_kink(CollidingPoint& point, const Vec3d& n)
{
    const Support& on = point.on[0];
    Contact contact;
    contact.time = 0;
    contact.n = n;
    contact.vc = on.vc;
    Path& path = point.path;
    path.v += contact.vc;
    resolver_.resolve(point, {path.P, path.v, path.a + on.ac, path.v}, contact, on.collider);
    point.kind = CollidingPoint::Waits;
}

// Projects onto the surface by two Newton steps. Leaves the gradients at the last but one position.
void CurvedMotion::project(std::span<const CollidingPoint> points, const Obstacle& obstacle)
{
    for (int step = 0; step < 2; ++step) {
        query_.find_gradients_at_times(*obstacle.shape);
        for (std::size_t j = 0; j < query_.size(); ++j) step_to_surface(points[query_.point[j]].i, j, obstacle);
    }
}

void CurvedMotion::step_to_surface(std::size_t i, std::size_t j, const Obstacle& obstacle)
{
    const double slope2 = query_.gradient[j].squaredNorm();
    if (slope2 > 0) query_.P[j] -= (query_.phi[j] - block_.radius(obstacle, i)) / slope2 * query_.gradient[j];
}

void CurvedMotion::end_piece(CollidingPoint& point, std::size_t j) const
{
    Path& path = point.path;
    CollidingPoint::PieceEnd& end = point.end;
    const Support& on = point.on[0];
    const double slope = query_.gradient[j].norm(), s = path.duration;
    end.P = query_.P[j];
    end.a = path.a + on.ac;
    end.n = slope > 0 ? Vec3d(query_.gradient[j] / slope) : on.n;
    if (point.stops)
        end.v = Vec3d::Zero();
    else if (!find_end_velocity(point))
        return;
    end.v += on.vc + s * on.ac;
    end.P += s * (on.vc + 0.5 * s * on.ac);
    point.piece = std::min(2 * s, block_.dt[point.i]);
    draw_chord(point);
}

// Sets the path to the chord, along which other shapes are searched.
void CurvedMotion::draw_chord(CollidingPoint& point) const
{
    Path& path = point.path;
    if (path.duration > 0) path.v = (point.end.P - path.P) / path.duration;
    path.a.setZero();
}

// Corrects the ends of the pieces, which were found in the surface's initial frame: the surface has turned since, and
// its path differs from its initial velocity and acceleration.
void CurvedMotion::follow_surface(std::span<CollidingPoint> points, const Obstacle& obstacle)
{
    for (std::size_t j = 0; j < query_.size(); ++j) {
        const CollidingPoint& point = points[query_.point[j]];
        query_.P[j] = point.end.P;
        query_.time[j] += point.path.duration;
    }
    query_.find_gradients_at_times(*obstacle.shape);
    for (std::size_t j = 0; j < query_.size(); ++j) {
        CollidingPoint& point = points[query_.point[j]];
        const double slope = query_.gradient[j].norm();
        if (point.kind != CollidingPoint::Curved || !(slope > 0)) continue;
        step_to_surface(point.i, j, obstacle);
        point.end.P = query_.P[j];
        point.end.n = query_.gradient[j] / slope;
        draw_chord(point);
        const Support& on = point.on[0];
        if (!point.stops && !on.ac.isZero(0) && !(on.viscosity > 0)) find_end_velocity_on_moving(point);
    }
}

// Finds the final velocity on a surface that turns or accelerates, in the world frame, from the mean of the
// accelerations at both ends.
void CurvedMotion::find_end_velocity_on_moving(CollidingPoint& point) const
{
    CollidingPoint::PieceEnd& end = point.end;
    const Support& on = point.on[0];
    const Obstacle& obstacle = block_.obstacles[on.collider];
    const double s = point.path.duration, now = block_.frame_time(point.i, point.left - s);
    Support there = on;
    there.n = end.n;
    there.curvature = end.curvature;
    there.vc = obstacle.shape->velocity_at(end.P, now);
    const Vec3d v0 = on.vc + point.slip, v1 = tangential_to(there, v0 + s * end.a);
    there.ac = obstacle.acceleration_at(end.P, v1, now);
    const Vec3d& a = motion_.acceleration(point.i);
    const Vec3d a1 = there.ac + tangential_acceleration(slide_on(there, v1, a, 0, 0), a - there.ac, end.n);
    end.v = tangential_to(there, v0 + 0.5 * s * (end.a + a1));
}

// Finds the final velocity in the surface's frame. Returns false if the surface does not support the point up to
// there; the point then waits.
bool CurvedMotion::find_end_velocity(CollidingPoint& point) const
{
    const Path& path = point.path;
    CollidingPoint::PieceEnd& end = point.end;
    const Support& on = point.on[0];
    const Vec3d& a = motion_.acceleration(point.i);
    const double s = path.duration;
    const auto turned = [&](const Vec3d& x) { return transported(x, on.n, end.n); };
    Support there = on;
    there.n = end.n;
    there.curvature = end.curvature;
    const Vec3d v1 = turned(path.v + s * path.a);
    const Slide next = slide_on(there, v1 + on.vc, a, 0, 0);
    if (next.kind == Slide::Leaves) {
        const double shortest = shortest_piece(block_.obstacles[on.collider], path, block_.dt[point.i]);
        if (s > shortest) return wait_for(point, shortest), false;
    }
    const Vec3d pull = a - on.ac;
    const Vec3d a1 = tangential_acceleration(next, pull, end.n);
    if (on.viscosity > 0) {
        const Propagator by = respond(on.viscosity, 0, s);
        end.v = by.v_of_v * turned(point.slip) + 0.5 * by.v_of_G * (turned(point.drive) + a1);
        end.v -= end.n.dot(end.v) * end.n;
        return true;
    }
    end.v = turned(path.v + 0.5 * s * path.a) + 0.5 * s * a1;
    end.v -= end.n.dot(end.v) * end.n;
    // The energy is more accurate than the speed, so it rescales the velocity: the work of the pull along the path,
    // minus that of friction, which is the rest of the accelerations. Not applied to a point that turns back, whose
    // speed is the small difference of larger ones.
    const double friction0 = (pull - path.a).dot(path.v), friction1 = (pull - a1).dot(end.v);
    const double speed2 = path.v.squaredNorm() + 2 * pull.dot(end.P - path.P) - s * (friction0 + friction1);
    const double scale2 = speed2 / end.v.squaredNorm();
    if (scale2 > 0.8 && scale2 < 1.25) end.v *= std::sqrt(scale2);
    return true;
}

void ContactRounds::start(std::uint32_t i)
{
    const std::size_t slot = started_++;
    if (slot == points_.size()) points_.emplace_back();
    CollidingPoint& point = points_[slot];
    point.begin(i, block_.dt[i]);
    const double s = contacts_.contact(i).time;
    const Path path = motion_.path(i);
    const ContactResolver::Arrival arrival{path.at(s), motion_.velocity_after(i, s), motion_.acceleration(i), path.v};
    point.by_forces.begin(arrival.P, arrival.v);
    resolver_.resolve(point, arrival, contacts_.contact(i), contacts_.obstacle(i));
    if (plan_next_path(point)) active_.push_back(static_cast<std::uint32_t>(slot));
}

void ContactRounds::resume(std::uint32_t i, double left, const std::optional<Support>& on)
{
    const std::size_t slot = started_++;
    if (slot == points_.size()) points_.emplace_back();
    CollidingPoint& point = points_[slot];
    point.begin(i, block_.dt[i]);
    point.left = left;
    if (on) point.on[0] = *on, point.supports = 1;
    point.by_forces.begin(block_.P[i], block_.v[i]);
    if (plan_next_path(point)) active_.push_back(static_cast<std::uint32_t>(slot));
}

void ContactRounds::run()
{
    while (!active_.empty()) {
        curved_.find_ends(points_, active_);
        find_contacts();
        next_active_.clear();
        for (const std::uint32_t slot : active_) {
            CollidingPoint& point = points_[slot];
            if (point.kind != CollidingPoint::Waits) {
                if (contacts_.has(point.i))
                    resolver_.resolve_on_path(point, contacts_.contact(point.i), contacts_.obstacle(point.i));
                else
                    planner_.finish_path(point);
            }
            if (plan_next_path(point)) next_active_.push_back(slot);
        }
        active_.swap(next_active_);
    }
    started_ = 0;
}

// Plans the next path of a point, and follows it if no shape has to be queried. Returns false if its substep is over.
bool ContactRounds::plan_next_path(CollidingPoint& point)
{
    while (planner_.plan(point)) {
        if (point.kind == CollidingPoint::Curved || may_meet_shape(point)) return true;
        planner_.finish_path(point);
    }
    const auto surface = [&](int k) {
        return k < point.supports ? TouchedPoints::Surface{point.on[k].collider, point.on[k].n}
                                  : TouchedPoints::Surface{};
    };
    touched_.set_surfaces(point.i, {surface(0), surface(1)});
    if (motion_.is_damped()) {
        point.by_forces.advance(block_.P[point.i], motion_.acceleration(point.i));
        audit_.add_work(point.i, point.by_forces.contact_work(block_.v[point.i]));
    }
    return false;
}

bool ContactRounds::may_meet_shape(const CollidingPoint& point) const
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (may_meet(point, o)) return true;
    return false;
}

// Returns true if the path may lead to a shape that the point is not on.
bool ContactRounds::may_meet(const CollidingPoint& point, std::size_t obstacle) const
{
    return !point.rests_on(static_cast<int>(obstacle)) && block_.may_reach_obstacle(point.i, point.path, obstacle);
}

// Searches all shapes, because a bounce may lead to any of them.
void ContactRounds::find_contacts()
{
    for (const std::uint32_t slot : active_) contacts_.clear(points_[slot].i);
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        for (const std::uint32_t slot : active_) {
            const CollidingPoint& point = points_[slot];
            if (point.kind == CollidingPoint::Waits || !may_meet(point, o)) continue;
            Path path = point.path;
            path.radius = block_.radius(block_.obstacles[o], point.i);
            path.begin = block_.frame_time(point.i, point.left);
            contacts_.add(point.i, path);
        }
        contacts_.query(o);
    }
}

}  // namespace rapid

#include "runtime/solver/collision/contact_resolver.h"

#include <algorithm>
#include <cmath>

#include "runtime/solver/collision/obstacle.h"

namespace rapid {
namespace {

// Relative normal velocity after a bounce, due to rounding, up to which a point stays on the surface that it rests on.
constexpr double tangential = 1e-9;

// Relative velocity along one side of a valley and out of the other side up to which the point stays in the valley:
// two responses leave this much of a velocity across it.
constexpr double valley = 1e-6;

// Limit of impacts of a point in one substep that follow soon after another, after which it rests for the remaining
// time: between closing shapes, impacts never end. Impacts of a fast point that crosses a room, or of one that comes
// to rest on a surface, are farther apart, or fewer.
constexpr int max_impacts = 2000;  // larger than the event count of a chatter check (contact_rounds.cpp)
constexpr double soon = 1e-4;      // relative to the substep

// Counts an impact towards max_contacts with the weight that makes the limit max_impacts. Chatter checks ignore that
// weight.
bool is_jammed(CollidingPoint& point)
{
    constexpr int weight = max_contacts / max_impacts;
    point.events += weight;
    point.checked_events += weight;
    return point.events >= max_contacts;
}

}  // namespace

void ContactResolver::resolve(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int o)
{
    const Response response = block_.obstacles[o].response;
    block_.P[point.i] = arrival.P;
    block_.v[point.i] = arrival.v;
    point.left -= contact.time;
    if (++point.events >= max_contacts) {
        audit_.add_limited();
        point.left = 0;
    }
    if ((response == Response::Stick && !stuck_.is_torn(point.i, o)) || response == Response::Die)
        capture(point, contact, o);
    else if (contact.depth > 0)
        ejection_.eject(point, contact, o, arrival.path_v, arrival.a);
    else
        respond(point, arrival, contact, o);
}

void ContactResolver::resolve_on_path(CollidingPoint& point, const Contact& contact, int o)
{
    const Path& path = point.path;
    const double s = contact.time;
    if (point.kind == CollidingPoint::Curved)
        resolve(point, arrival_on_chord(point, s), contact, o);
    else
        resolve(point, {path.at(s), path.v + s * path.a, path.a, path.v}, contact, o);
}

// Corrects a contact found on the chord of a piece along a curved surface: the arc deviates from the chord by κ d²/2 u
// (1 - u).
ContactResolver::Arrival ContactResolver::arrival_on_chord(CollidingPoint& point, double time) const
{
    const Path& chord = point.path;
    const CollidingPoint::PieceEnd& end = point.end;
    const double u = chord.duration > 0 ? time / chord.duration : 0;
    Support& on = point.on[0];
    const Vec3d d = end.P - chord.P, v0 = block_.v[point.i];
    on.n = ((1 - u) * on.n + u * end.n).normalized();
    on.curvature = end.curvature;
    Vec3d v = (1 - u) * v0 + u * end.v - on.vc;
    v += on.vc - v.dot(on.n) * on.n;
    return {chord.P + u * d + 0.5 * end.curvature * d.squaredNorm() * u * (1 - u) * on.n, v, end.a, chord.v};
}

// Ends the substep of a point that the shape holds or kills.
void ContactResolver::capture(CollidingPoint& point, const Contact& contact, int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::size_t i = point.i;
    const Vec3d P = block_.P[i], v = block_.v[i];
    const double when = block_.time(i, point.left);
    if (contact.depth > 0) {
        ejection_.displace(point.i, contact.depth * contact.n);
        point.by_forces.from += contact.depth * contact.n;
    }
    block_.v[i] = contact.vc;
    audit_.add(i, o, {P, contact.n, contact.vc, -(v - contact.vc).dot(contact.n), v, contact.vc - v, when});
    if (obstacle.response == Response::Die)
        block_.context.kill(block_.indices[i], when);
    else
        stuck_.hold(i, o, point.left);
    point.left = 0;
    point.supports = 1;
    point.on[0] = {o, contact.n, contact.vc, contact.curvature, 0, contact.flat, obstacle.feature};
}

// After a contact that leaves with the speed u, under the acceleration g into the surface, all further bounces
// together take 2u/(g (1 - ε)). If they would be over within this substep, the point rests from now on. The momentum
// that they would take from the tangent by friction equals, to the last digit, that of one contact with ε = 0 and the
// subsequent sliding: μ (1 + ε) |vn| (1 + ε + ε² + ...) = μ |vn| + μ g 2u/(g (1 - ε)).
void ContactResolver::respond(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::size_t i = point.i;
    const double epsilon = obstacle.restitution(block_.indices[i]), friction = obstacle.friction[block_.indices[i]];
    const Vec3d &P = arrival.P, &v = arrival.v, &a = arrival.a;
    const Vec3d& n = contact.n;
    const Vec3d relative = v - contact.vc;
    const double vn = relative.dot(n);
    const Vec3d along = v - vn * n;
    const Vec3d ac = obstacle.acceleration_at(P, along, block_.frame_time(i, point.left));
    const double g = -(a - ac).dot(n) - contact.curvature * (along - contact.vc).squaredNorm();
    const double u = vn < 0 ? -epsilon * vn : vn;
    const double tolerance = obstacle.contact_tolerance(P, block_.radius(obstacle, i));
    const double rising2 = g > 0 ? 2 * g * tolerance : 0;  // for a speed that lifts by less than rounding
    const bool hits = vn < 0 && vn * vn > rising2;
    const double when = block_.time(i, point.left);

    const Support support{o,
                          n,
                          contact.vc,
                          contact.curvature,
                          friction,
                          contact.flat,
                          obstacle.feature,
                          ac,
                          obstacle.viscosity[block_.indices[i]],
                          obstacle.adhesion_to_sliding(block_.indices[i])};
    // A velocity relative to a moving surface has the rounding of both.
    const double still = tangential * relative.norm() + 0x1p-50 * contact.vc.norm();
    if (g < -support.adhesion && vn >= -still)
        part(point, arrival, contact, o, (a - ac).norm());
    else if (vn >= 0 || u * u <= rising2 || 2 * u <= g * (1 - epsilon) * point.left)
        rest(point, support, contact_response(v, contact.vc, n, 0, friction));
    else
        bounce(point, support, epsilon);
    if (hits && contact.time < soon * block_.dt[i] && is_jammed(point)) {
        audit_.add_limited();
        block_.v[i] = contact.vc;
        point.left = 0;
        point.supports = 1;
        point.on[0] = support;
    }
    if (hits) audit_.add(i, o, {P, n, contact.vc, -vn, v, block_.v[i] - v, when});
}

// Handles a point that touches the surface and is pulled off it. pull: m/s², in the surface's frame.
void ContactResolver::part(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int o, double pull)
{
    const std::size_t i = point.i;
    if (contact.flat) {
        // An approach due to rounding would be met again and again at the same time. Other surfaces that the point
        // rests on still support it.
        block_.v[i] -= std::min((arrival.v - contact.vc).dot(contact.n), 0.0) * contact.n;
        return;
    }
    // The point touches to within the accuracy of the field, so the next moments belong to the path. They are long
    // enough for a point that grazes an edge to pass it in a few steps, and too short for a point that a facet does
    // support to sink into it.
    const Obstacle& obstacle = block_.obstacles[o];
    const double speed = (arrival.v - contact.vc).norm();
    const double passes = obstacle.feature > 0 ? time_to_travel(obstacle.feature / 64, speed, pull) : 0;
    const double tolerance = obstacle.contact_tolerance(arrival.P, block_.radius(obstacle, i));
    const double sinks = pull > 0 ? std::sqrt(tolerance / pull) : passes;
    const double s = std::min(point.left, std::max(min_piece * block_.dt[i], std::min(passes, sinks)));
    block_.P[i] += s * (arrival.v + 0.5 * s * arrival.a);
    block_.v[i] += s * arrival.a;
    point.left -= s;
    point.supports = 0;
}

void ContactResolver::bounce(CollidingPoint& point, const Support& support, double epsilon)
{
    Vec3d& v = block_.v[point.i];
    v = contact_response(v, support.vc, support.n, epsilon, support.friction);
    const double off = tangential * v.norm();
    const auto leaves = [&](const Support& on) { return std::abs((v - on.vc).dot(on.n)) > off; };
    if (point.supports == 2 && leaves(point.on[1])) point.supports = 1;
    if (point.supports >= 1 && leaves(point.on[0])) point.on[0] = point.on[1], --point.supports;
    if (point.left == 0 && point.supports == 0) point.on[0] = support, point.supports = 1;
}

// Adds a support: on one surface the point slides, on two it moves along their edge, on three it stops.
void ContactResolver::rest(CollidingPoint& point, const Support& support, const Vec3d& v)
{
    Vec3d along = tangential_to(support, v) - support.vc;
    if (point.supports == 0 || is_same_surface(point, support, along)) {
        point.supports = std::max(point.supports, 1);
        point.on[point.supports - 1] = support;
    } else if (point.supports == 1 && !edge_of(point.on[0], support).isZero()) {
        point.on[1] = support;
        point.supports = 2;
    } else if (point.supports == 1) {
        point.on[0] = support;
    } else {
        along.setZero();
        point.left = 0;
    }
    if (point.supports == 2) {
        const Vec3d edge = edge_of(point.on[0], point.on[1]);
        along = along.dot(edge) * edge;
    }
    block_.v[point.i] = support.vc + along;
}

// Returns true if the new support continues the last one. Two facets of one field are two surfaces if they form a
// valley in which the point lies, neither moving out of it nor pulled out.
bool ContactResolver::is_same_surface(const CollidingPoint& point, const Support& support, const Vec3d& along) const
{
    if (point.supports == 0 || point.on[point.supports - 1].collider != support.collider) return false;
    if (point.supports != 1) return true;
    const Vec3d& other = point.on[0].n;
    const Vec3d& a = motion_.acceleration(point.i);
    const Vec3d pull = a - a.dot(support.n) * support.n;
    return along.dot(other) > valley * along.norm() || pull.dot(other) >= 0 || edge_of(point.on[0], support).isZero();
}

}  // namespace rapid

#include "runtime/solver/collision/collisions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/parallel.h"
#include "runtime/points/members.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/solver/collision/response.h"

namespace rapid {
namespace {

// How often a point is taken out of shapes in one sub-step before it counts as trapped: out of one it may be in
// another, and where a field is no exact distance it takes a few steps out of one.
constexpr int most_rescues = 64;

// How far a surface may turn within a piece of a slide, as the cosine of 0.2 radians. The length of the way along a
// circle is then right to 1e-5 a piece.
constexpr double least_cosine = 0.98;

// A surface that curves inwards by a smaller radius than its field can show is a kink, at which a point bounces. A turn
// of less than this, in radians, is the field's noise.
constexpr double least_kink = 0.02;

// The part of its size that a velocity after a bounce may have along the normal of a surface that the point rests on,
// and leave the point on it: rounding.
constexpr double tangential = 1e-9;

// The part of its size that a velocity along one side of a valley may have out of the other side, of a point that stays
// in the valley: what two responses leave of a velocity across it.
constexpr double valley = 1e-6;

// A point that has gone nowhere, to rounding, in this many contacts and pieces is at rest: in a pit of a field it can
// chatter at 1e-10 m/s between facets that each would let it slide. Real impacts move a point farther than that.
constexpr int chatter = 1024;

// A point that sticks has the surface's velocity, to single precision, m/s.
constexpr double held = 1e-6;

// The shortest pieces of a slide, as parts of the sub-step: where friction turns, and where a surface without a
// smallest feature does.
constexpr double least_turning = 1.0 / 256, least_bending = 1.0 / 4096;

// s, of a piece along a curved surface
double least_piece(const Obstacle& obstacle, const Path& path, double dt)
{
    if (!(obstacle.feature > 0)) return least_bending * dt;
    return detail::time_to_travel(obstacle.feature / 64, path.v.norm(), path.a.norm());
}

// A velocity without its part along the normal, in the surface's frame.
Vec3d tangential_to(const Support& on, const Vec3d& v)
{
    const Vec3d relative = v - on.vc;
    return on.vc + (relative - relative.dot(on.n) * on.n);
}

bool is_clear_of(const Box3d& box, const Vec3d& P, double radius)
{
    return ((P - box.max()).array() > radius).any() || ((box.min() - P).array() > radius).any();
}

// A place outside a shape, not much farther away than the nearest in any of 26 directions; P where there is none.
Vec3d place_outside(const Obstacle& obstacle, const Vec3d& P, double radius)
{
    const double size = obstacle.bounds.sizes().maxCoeff() + 2 * radius;
    if (!std::isfinite(size)) return P;
    std::array<Vec3d, 26> places;
    std::array<double, 26> phi;
    for (double reach = std::max(obstacle.feature, 0x1p-10 * size); reach < 2 * size; reach *= 1.25) {
        for (int k = 0, direction = 0; k < 27; ++k) {
            const Vec3d d(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
            if (!d.isZero()) places[direction++] = P + reach * d.normalized();
        }
        obstacle.shape->distance(places, phi, {});
        const auto highest = std::max_element(phi.begin(), phi.end());
        if (*highest >= radius) return places[highest - phi.begin()];
    }
    return P;
}

// Moves one coordinate, the one along which the normal is longest, by the least that lifts the point by `height`.
Vec3f lifted(Vec3f P, const Vec3d& n, double height)
{
    int k;
    n.cwiseAbs().maxCoeff(&k);
    const double wanted = P[k] + height / n[k];
    const float outward = std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(n[k]));
    P[k] = static_cast<float>(wanted);
    if (n[k] > 0 ? P[k] < wanted : P[k] > wanted) P[k] = std::nextafter(P[k], outward);
    return P;
}

}  // namespace

Obstacle::Obstacle(const Collider& collider, const PointSet& points)
    : shape(collider.shape.get()),
      bounds(shape->bounds()),
      feature(shape->smallest_feature()),
      moves(shape->moves()),
      body(dynamic_cast<const RigidBody*>(shape)),
      plane(shape->half_space()),
      method(collider.method),
      response(collider.response),
      record(collider.record),
      bounce(collider.bounce.read(points)),
      friction(collider.friction.read(points)),
      radius(radii_of(collider.radius, points)),
      members(members_of(points, collider.group))
{
}

void Collisions::begin(std::span<const std::uint32_t> places)
{
    for (auto& side : moved_on_) side.resize(obstacles_.size());
    near_.resize(obstacles_.size());
    places_ = places;
    const std::size_t size = size_ = places.size();
    met_.assign(size, 0);
    put_off_.assign(size, 0);
    put_out_.clear();
    stuck_.assign(size, 0);
    held_.clear();
    touched_.clear();
    lost_.clear();
    travellers_.resize(size);
    paths_.resize(size);
    bends_.resize(size);
    obstacle_.resize(size);
    contact_.resize(size);
    surfaces_.resize(size);
    before_.resize(size);
    plane_.assign(size, -1);
    steps_back_ = std::any_of(obstacles_.begin(), obstacles_.end(),
                              [](const Obstacle& o) { return o.method != Method::Continuous; });
    widest_.clear();
    for (const Obstacle& obstacle : obstacles_) {
        float widest = 0;
        for (std::size_t i = 0; i < (obstacle.radius.stride ? size : 1); ++i)
            widest = std::max(widest, obstacle.radius[places[i]]);
        widest_.push_back(widest);
    }
}

void Collisions::advance(std::span<Vec3d> P, std::span<Vec3d> v, const Drift& drift)
{
    P_ = P;
    v_ = v;
    a_ = drift.a;
    after_ = drift.after;
    damped_ = drift.damped;
    const std::span<const double> dt = drift.dt;
    if (!damped_.empty()) {
        mean_a_.resize(size_);
        path_v_.resize(size_);
        path_a_.resize(size_);
        for (std::size_t i = 0; i < size_; ++i) {
            mean_a_[i] = dt[i] > 0 ? Vec3d((damped_[i].v - v[i]) / dt[i]) : damped_[i].G;
            path_v_[i] = damped_[i].path_v;
            path_a_[i] = damped_[i].path_a;
        }
        a_ = {mean_a_.data(), 1};
    }
    if (steps_back_) start_.assign(P.begin(), P.end());
    hold_stuck(dt);
    fly(a_, dt);
    while (!going_.empty()) round_of_travellers(a_, dt);
    for (std::size_t o = 0; steps_back_ && o < obstacles_.size(); ++o)
        if (obstacles_[o].method != Method::Continuous) correct(static_cast<int>(o), dt);
    if (damped_.empty()) audit_energy();
}

// A free path keeps v²/2 - a·P, so all that has changed of it is the doing of contacts.
void Collisions::audit_energy()
{
    for (const std::uint32_t i : touched_) {
        const double mass = consequences_.mass[places_[i]];
        if (stuck_[i] || std::isinf(mass)) continue;
        const Vec3d begun = flight_.P(i), v = flight_.v(i);  // as they were, since exchange()
        const double change = 0.5 * (v_[i] - v).dot(v_[i] + v) - a_[i].dot(P_[i] - begun);
        energy.take(mass * change);
    }
}

void Collisions::touch(std::size_t i)
{
    if (met_[i]) return;
    met_[i] = 1;
    if (consequences_.met) consequences_.met[places_[i]] = 1;
    touched_.push_back(static_cast<std::uint32_t>(i));
    surfaces_[i] = {no_surface, no_surface};
}

// Points that have come to rest on a shape that they stick to stay, whatever pulls: they are flush with it, and have
// its velocity.
void Collisions::hold_stuck(std::span<const double> dt)
{
    for (const std::uint32_t i : held_) stuck_[i] = 0;
    held_.clear();
    for (const Obstacle& obstacle : obstacles_) {
        if (obstacle.response != Response::Stick) continue;
        asked_.clear();
        asked_P_.clear();
        asked_time_.clear();
        for (std::size_t i = 0; i < size_; ++i) {
            if (!obstacle.members[places_[i]] || stuck_[i]) continue;
            const double now = since_begin(i, dt[i]);
            const Vec3d vc = obstacle.shape->velocity_at(P_[i], now);
            if (!((v_[i] - vc).norm() <= held * (1 + vc.norm()))) continue;
            asked_.push_back(i);
            asked_P_.push_back(P_[i]);
            asked_time_.push_back(now);
        }
        if (asked_.empty()) continue;
        phi_.resize(asked_.size());
        obstacle.shape->distance_at(asked_P_, asked_time_, phi_, {});
        for (std::size_t j = 0; j < asked_.size(); ++j) {
            const std::size_t i = asked_[j];
            const double radius = obstacle.radius[places_[i]], now = asked_time_[j];
            if (std::abs(phi_[j] - radius) > flush_within(P_[i], radius, obstacle.feature * 0x1p-21)) continue;
            held_.push_back(static_cast<std::uint32_t>(i));
            stuck_[i] = 1;
            plane_[i] = -1;
            touch(i);
            // Along the body's field of velocities: of the fourth order (Runge and Kutta).
            const auto flow = [&](const Vec3d& x, double s) { return obstacle.shape->velocity_at(x, now + s); };
            const double t = dt[i];
            const Vec3d k1 = flow(P_[i], 0), k2 = flow(P_[i] + 0.5 * t * k1, 0.5 * t);
            const Vec3d k3 = flow(P_[i] + 0.5 * t * k2, 0.5 * t), k4 = flow(P_[i] + t * k3, t);
            P_[i] += t / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
            v_[i] = flow(P_[i], t);
            surfaces_[i] = {
                Surface{static_cast<int>(&obstacle - obstacles_.data()), normal_at(obstacle, P_[i], now + t)},
                no_surface};
        }
    }
}

// Of what goes on along a surface as it is; zero where that is not known.
Vec3d Collisions::acceleration_of(const Obstacle& obstacle, const Vec3d& P, const Vec3d& v, double time) const
{
    return obstacle.body ? obstacle.body->acceleration_at(P, v, time) : Vec3d(Vec3d::Zero());
}

// The unit normal of a shape's field; zero where it has none.
Vec3d Collisions::normal_at(const Obstacle& obstacle, const Vec3d& P, double time) const
{
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    obstacle.shape->distance_at({&P, 1}, {&time, 1}, {&phi, 1}, {&gradient, 1});
    return gradient.normalized();
}

Path Collisions::free_path(std::size_t i, double dt) const
{
    const bool free = damped_.empty();
    return {P_[i], free ? v_[i] : path_v_[i], free ? a_[i] : path_a_[i], dt, 0, since_begin(i, dt)};
}

// Its free path goes to the shape that is asked next.
void Collisions::ask_about(std::uint32_t i, int o, double dt)
{
    plane_[i] = -1;
    asked_.push_back(i);
    asked_paths_.push_back(free_path(i, dt));
    Path& path = asked_paths_.back();
    path.radius = obstacles_[o].radius[places_[i]];
    if (obstacle_[i] >= 0) path.duration = contact_[i].time;  // only an earlier contact is of interest
}

// The time of a point that has so much left of its sub-step, for shapes that move in the frame.
double Collisions::since_begin(std::size_t i, double left) const { return consequences_.h - after_[i] - left; }

// On the free path. A drag's velocity falls from the first to the last; between, it is on a straight line.
Vec3d Collisions::velocity_after(std::size_t i, double s, double dt) const
{
    if (damped_.empty()) return v_[i] + s * a_[i];
    return dt > 0 ? Vec3d(v_[i] + s / dt * (damped_[i].v - v_[i])) : v_[i];
}

// All points on their free paths. Those that meet nothing are at the end of the sub-step.
void Collisions::fly(Strided<Vec3d> a, std::span<const double> dt)
{
    if (damped_.empty()) {
        flight_.begin(P_, v_, a, dt);
    } else {
        flight_.begin(P_, path_v_, {path_a_.data(), 1}, dt);
        for (std::size_t i = 0; i < size_; ++i) flight_.end_with(i, flight_.P(i), damped_[i].v);
    }
    std::fill_n(obstacle_.begin(), size_, -1);
    meeting_.clear();
    near_count_.assign(size_, 0);
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        near_[o].clear();
        if (obstacles_[o].method != Method::Continuous) continue;
        flight_.find_near(obstacles_[o].bounds, widest_[o], near_[o]);
        for (const std::uint32_t i : near_[o]) ++near_count_[i];
    }
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const Obstacle& obstacle = obstacles_[o];
        const bool plane = obstacle.plane && damped_.empty();
        asked_.clear();
        asked_paths_.clear();
        for (const std::uint32_t i : near_[o]) {
            if (!obstacle.members[places_[i]] || stuck_[i]) continue;
            if (!plane || near_count_[i] > 1) {
                ask_about(i, static_cast<int>(o), dt[i]);
                continue;
            }
            const std::uint32_t at = places_[i];
            pass_.add(i, P_[i], v_[i], a[i], dt[i], obstacle.radius[at],
                      obstacle.response == Response::Slide ? 0.0f : obstacle.bounce[at], obstacle.friction[at]);
            if (pass_.is_full()) pass_plane(static_cast<int>(o), dt);
        }
        if (pass_.size > 0) pass_plane(static_cast<int>(o), dt);
        ask_first_contacts(static_cast<int>(o));
    }

    // All go to the ends of their free paths. Those that are held, or meet something, come back from there.
    flight_.exchange(P_, v_);
    for (const std::uint32_t i : held_) {
        P_[i] = flight_.P(i);
        v_[i] = flight_.v(i);
    }
    going_.clear();
    for (const std::uint32_t i : meeting_) {
        P_[i] = flight_.P(i);
        v_[i] = flight_.v(i);
        touch(i);
        if (slides_on_plane(i, a[i], dt[i])) continue;
        Traveller& t = travellers_[i];
        t.begin(i, dt[i]);
        const double s = contact_[i].time;
        meet(t, place(free_path(i, dt[i]), s), velocity_after(i, s, dt[i]), a[i], contact_[i], obstacle_[i], dt[i]);
        if (goes_on(t, a[i], dt[i])) going_.push_back(t.i);
    }
}

// Takes the points of pass_ through the whole sub-step; those for which there is more to it are left to be asked.
void Collisions::pass_plane(int o, std::span<const double> dt)
{
    const Obstacle& obstacle = obstacles_[o];
    const bool responds = obstacle.response == Response::Bounce || obstacle.response == Response::Slide;
    const Vec3d n = obstacle.plane->n;
    pass_.solve(*obstacle.plane);
    for (std::size_t other = 0; other < obstacles_.size(); ++other)
        if (static_cast<int>(other) != o && obstacles_[other].method == Method::Continuous)
            pass_.leave_out_near(obstacles_[other].bounds, widest_[other]);
    for (std::size_t j = 0; j < pass_.size; ++j) {
        const std::uint32_t i = pass_.place[j];
        const auto kind = pass_.kind[j];
        if (kind == PlanePass::More || (kind != PlanePass::Misses && !responds)) {
            ask_about(i, o, dt[i]);
            continue;
        }
        plane_[i] = steps_back_ ? -1 : o;
        if (kind == PlanePass::Misses) continue;
        flight_.end_with(i, pass_.end(j), pass_.velocity(j));
        touch(i);
        if (kind == PlanePass::Bounces)
            count(i, pass_.from(j), n, Vec3d::Zero(), pass_.approach[j], pass_.change(j),
                  consequences_.time - after_[i] - pass_.left[j], o);
        else
            surfaces_[i] = {Surface{o, n}, no_surface};
    }
    pass_.size = 0;
}

// Takes a point through the whole sub-step that lies on a plane, and meets nothing else on its way along it: most of
// those that touch anything, on any floor. To the bit what a Traveller would do, at a third of its cost; false where
// there is more to it.
bool Collisions::slides_on_plane(std::size_t i, const Vec3d& a, double dt)
{
    const Contact& contact = contact_[i];
    if (!contact.flat || contact.time > 0 || contact.depth > 0) return false;
    const int o = obstacle_[i];
    const Obstacle& obstacle = obstacles_[o];
    if (obstacle.response == Response::Stick || obstacle.response == Response::Die) return false;
    if (!acceleration_of(obstacle, P_[i], v_[i], since_begin(i, dt)).isZero(0)) return false;
    const double g = -a.dot(contact.n), vn = (v_[i] - contact.vc).dot(contact.n);
    const double flush = flush_within(P_[i], obstacle.radius[places_[i]], obstacle.feature * 0x1p-21);
    if (!(g > 0) || vn * vn > 2 * g * flush) return false;

    const double friction = obstacle.friction[places_[i]];
    const Support on{o, contact.n, contact.vc, 0, friction, true, obstacle.feature};
    const Vec3d v = tangential_to(on, contact_response(v_[i], on.vc, on.n, 0, friction));
    const Slide slide = slide_on(on, v, a, dt, least_turning * dt);
    if (slide.kind == Slide::Leaves) return false;
    if (slide.kind == Slide::Moves) {
        const double left = dt - slide.duration;
        if (left > 0 && !(slide.stops && slide_on(on, on.vc, a, left, 0).kind == Slide::Sticks)) return false;
        const Path path{P_[i], v, slide.a, slide.duration, 0};
        for (std::size_t other = 0; other < obstacles_.size(); ++other)
            if (static_cast<int>(other) != o &&
                may_reach_shape(i, path.P, place(path, path.duration), path.a, path.duration, other))
                return false;
        P_[i] = place(path, path.duration) + left * on.vc;
        v_[i] = slide.stops ? on.vc : Vec3d(path.v + path.duration * path.a);
    } else {
        v_[i] = on.vc;
        P_[i] += dt * on.vc;
    }
    surfaces_[i] = {Surface{o, on.n}, no_surface};
    return true;
}

void Collisions::meet_on_path(Traveller& t, const Path& path, double dt)
{
    const Contact& contact = contact_[t.i];
    const double s = contact.time;
    meet(t, place(path, s), path.v + s * path.a, path.a, contact, obstacle_[t.i], dt);
}

// Plans a point's way on, and takes it along as far as it needs to ask no shape; false when its sub-step is over.
bool Collisions::goes_on(Traveller& t, const Vec3d& a, double dt)
{
    Path& path = paths_[t.i];
    while (plan(t, path, a, dt)) {
        if (t.way == Traveller::Curved) return true;
        for (std::size_t o = 0; o < obstacles_.size(); ++o)
            if (may_meet(t, path, static_cast<int>(o))) return true;
        proceed(t, path, bends_[t.i]);
    }
    finish(t);
    return false;
}

void Collisions::round_of_travellers(Strided<Vec3d> a, std::span<const double> dt)
{
    bend(a, dt);
    search();
    going_on_.clear();
    for (const std::uint32_t i : going_) {
        Traveller& t = travellers_[i];
        if (t.way == Traveller::Waits)
            ;  // for the next round, with a shorter piece
        else if (obstacle_[i] < 0)
            proceed(t, paths_[i], bends_[i]);
        else if (t.way == Traveller::Curved)
            meet_on_bend(t, paths_[i], bends_[i], contact_[i], obstacle_[i], dt[i]);
        else
            meet_on_path(t, paths_[i], dt[i]);
        if (goes_on(t, a[i], dt[i])) going_on_.push_back(i);
    }
    going_.swap(going_on_);
}

// The next path of a point; false when it has none, because its sub-step is over.
bool Collisions::plan(Traveller& t, Path& path, const Vec3d& a, double dt)
{
    Vec3d& v = v_[t.i];
    while (true) {
        if (!(t.left > 0)) return false;
        if (!damped_.empty()) mean_a_[t.i] = damped_[t.i].mean_acceleration(v, t.left);
        path = {P_[t.i], v, a, t.left, 0};
        t.way = Traveller::Free;
        t.stops = false;
        if (t.supports == 0) return true;
        const auto ride = [&](const Support& on) {
            P_[t.i] += t.left * (on.vc + 0.5 * t.left * on.ac);
            v = on.vc + t.left * on.ac;
        };
        if (chatters(t)) return ride(t.on[0]), false;

        Slide slide;
        bool flat = t.on[0].flat;
        if (t.supports == 1) {
            slide = slide_on(t.on[0], v, a, t.left, least_turning * dt);
            if (slide.kind == Slide::Leaves) t.supports = 0;
        } else {
            flat = flat && t.on[1].flat;
            int lifted = -1;
            slide = slide_along(t.on[0], t.on[1], v, a, t.left, lifted);
            if (slide.kind == Slide::Leaves) {
                if (lifted == 0) t.on[0] = t.on[1];
                t.supports = 1;
            }
        }
        if (slide.kind == Slide::Leaves) continue;
        if (slide.kind == Slide::Sticks) return ride(t.on[0]), false;
        path.a = slide.a;
        path.duration = slide.duration;
        t.stops = slide.stops;
        if (flat) {
            t.way = Traveller::Straight;
            path.a += t.on[0].ac;
        } else if (t.supports == 1) {
            t.way = Traveller::Curved;  // in the surface's frame, to the end of the piece
            if (path.duration > t.piece) path.duration = t.piece, t.stops = false;
            if (++t.events >= most_contacts) return ++limited, false;
        } else {
            // Along the edge of curved surfaces in short straight pieces; each ends in the air, or within rounding of
            // the surfaces, where the next contact finds it.
            t.way = Traveller::Straight;
            path.a += t.on[0].ac;
            double most = dt / 16;
            if (const double feature = std::max(t.on[0].feature, t.on[1].feature); feature > 0)
                most = std::min(most, detail::time_to_travel(feature, path.v.norm(), path.a.norm()));
            if (path.duration > most) path.duration = most, t.stops = false;
            if (++t.events >= most_contacts) return ++limited, false;
        }
        return true;
    }
}

// Whether a point on a surface has been busy for long without getting anywhere in the surface's frame. On one that
// moves it gets somewhere with it.
bool Collisions::chatters(Traveller& t)
{
    if (t.events < t.watched + chatter) return false;
    t.watched = t.events;
    const Vec3d before = std::exchange(t.stood, P_[t.i]);
    const Support& on = t.on[0];
    const double radius = obstacles_[on.collider].radius[places_[t.i]];
    return (P_[t.i] - before).norm() <= flush_within(P_[t.i], radius, on.feature * 0x1p-21);
}

void Collisions::bend(Strided<Vec3d> a, std::span<const double> dt)
{
    for (std::size_t o = 0; o < obstacles_.size(); ++o) bend_on(static_cast<int>(o), a, dt);
}

// Pieces along the curved surface of one shape, of second order in position and velocity: velocity Verlet in the plane
// that turns with the surface.
//
// The piece d = v s + a s²/2 is tangential at its beginning. Where it ends the surface has turned by θ, so the chord of
// the arc of this length is d (1 - θ²/24), halfway between the tangents of both ends. What is left is taken off along
// the gradient.
void Collisions::bend_on(int o, Strided<Vec3d> a, std::span<const double> dt)
{
    const Obstacle& obstacle = obstacles_[o];
    const auto ask = [&] {
        phi_.resize(asked_P_.size());
        gradients_.resize(asked_P_.size());
        obstacle.shape->distance_at(asked_P_, asked_time_, phi_, gradients_);
    };
    const auto radius = [&](std::size_t k) { return double(obstacle.radius[places_[k]]); };

    asked_.clear();
    asked_P_.clear();
    asked_time_.clear();
    for (const std::uint32_t k : going_) {
        Traveller& t = travellers_[k];
        if (t.way != Traveller::Curved || t.on[0].collider != o) continue;
        Path& path = paths_[k];
        path.v -= t.on[0].vc + t.on[0].n.dot(path.v - t.on[0].vc) * t.on[0].n;  // along the surface, in its frame
        // Farther than its smallest feature the field may have anything: a wall across, or an edge.
        if (obstacle.feature > 0) {
            const double most = detail::time_to_travel(2 * obstacle.feature, path.v.norm(), path.a.norm());
            if (path.duration > most) path.duration = most, t.stops = false;
        }
        asked_.push_back(k);
        asked_P_.push_back(place(path, path.duration));  // in the surface's frame, as it is now
        asked_time_.push_back(since_begin(k, t.left));
    }
    if (asked_.empty()) return;
    ask();

    // Whether the surface is one up to there.
    std::size_t kept = 0;
    for (std::size_t j = 0; j < asked_.size(); ++j) {
        const std::size_t k = asked_[j];
        Traveller& t = travellers_[k];
        Path& path = paths_[k];
        const Vec3d d = asked_P_[j] - path.P, n = t.on[0].n;
        const double length = d.norm(), slope = gradients_[j].norm(), s = path.duration;
        const Vec3d n1 = slope > 0 ? Vec3d(gradients_[j] / slope) : n;
        const double cosine = n.dot(n1), turn = length > 0 ? (n1 - n).dot(d) / length : 0;
        const double curvature = length > 0 ? turn / length : 0;
        const double least = least_piece(obstacle, path, dt[t.i]);
        const bool leaves = -(a[t.i] - t.on[0].ac).dot(n) - curvature * path.v.squaredNorm() < 0;
        const bool kink = turn < -least_kink && -curvature * 2 * obstacle.feature > 1;
        if (s > least && (cosine < least_cosine || leaves || kink || !(slope > 0))) {
            t.piece = std::max(s / 4, least);
            t.way = Traveller::Waits;
            continue;
        }
        if (leaves) {
            // The next moments belong to the path: at an edge the surface may seem to curve less where the point
            // touches than along its way, and would be met at once again.
            const double moment = std::min(t.left, std::max(s, least_bending * dt[t.i]));
            P_[t.i] += moment * (v_[t.i] + 0.5 * moment * a[t.i]);
            v_[t.i] += moment * a[t.i];
            t.left -= moment;
            t.supports = 0;
            t.piece = dt[t.i];
            t.way = Traveller::Free;
            path = {P_[t.i], v_[t.i], a[t.i], t.left, path.radius};
            continue;
        }
        if (turn < 0 && (kink || cosine < least_cosine)) {
            Contact contact;
            contact.time = 0;
            contact.n = n1;
            contact.vc = t.on[0].vc;
            path.v += contact.vc;
            meet(t, path.P, path.v, path.a + t.on[0].ac, contact, o, dt[t.i]);
            t.way = Traveller::Waits;
            continue;
        }
        const Vec3d tangent = length > 0 ? Vec3d(d / length) : Vec3d(Vec3d::Zero());
        const Vec3d tangent1 = carried(tangent, n, n1);
        const Vec3d middle = tangent + tangent1;
        const double angle2 = 2 * (1 - std::min(1.0, cosine));
        bends_[k].curvature = curvature;
        asked_[kept] = k;
        asked_time_[kept] = asked_time_[j];
        asked_P_[kept++] = path.P + length * (1 - angle2 / 24) * (length > 0 ? middle.normalized() : middle);
    }
    asked_.resize(kept);
    asked_P_.resize(kept);
    asked_time_.resize(kept);

    for (int step = 0; step < 2; ++step) {
        ask();
        for (std::size_t j = 0; j < kept; ++j)
            if (const double slope2 = gradients_[j].squaredNorm(); slope2 > 0)
                asked_P_[j] -= (phi_[j] - radius(asked_[j])) / slope2 * gradients_[j];
    }
    ask();

    for (std::size_t j = 0; j < kept; ++j) {
        const std::size_t k = asked_[j];
        Traveller& t = travellers_[k];
        Path& path = paths_[k];
        Bend& end = bends_[k];
        const Support& on = t.on[0];
        const double slope = gradients_[j].norm(), s = path.duration;
        end.P = asked_P_[j];
        end.a = path.a + on.ac;
        end.n = slope > 0 ? Vec3d(gradients_[j] / slope) : on.n;
        const auto turned = [&](const Vec3d& x) { return carried(x, on.n, end.n); };
        if (t.stops) {
            end.v = Vec3d::Zero();
        } else {
            Support there = on;
            there.n = end.n;
            there.curvature = end.curvature;
            const Vec3d v1 = turned(path.v + s * path.a);
            const Slide next = slide_on(there, v1 + on.vc, a[t.i], 0, 0);
            if (next.kind == Slide::Leaves && s > least_piece(obstacle, path, dt[t.i])) {
                t.piece = std::max(s / 4, least_piece(obstacle, path, dt[t.i]));
                t.way = Traveller::Waits;
                continue;
            }
            const Vec3d pull = a[t.i] - on.ac;
            const Vec3d a1 = next.kind == Slide::Moves ? next.a : Vec3d(pull - pull.dot(end.n) * end.n);
            end.v = turned(path.v + 0.5 * s * path.a) + 0.5 * s * a1;
            end.v -= end.n.dot(end.v) * end.n;
            // The energy is known better than the velocity, whose direction that leaves: the weight's work along the
            // way, less that of friction, which is what else is in the accelerations. A point that turns back is left
            // out: its speed is the small difference of larger ones.
            const double friction0 = (pull - path.a).dot(path.v), friction1 = (pull - a1).dot(end.v);
            const double speed2 = path.v.squaredNorm() + 2 * pull.dot(end.P - path.P) - s * (friction0 + friction1);
            const double scale2 = speed2 / end.v.squaredNorm();
            if (scale2 > 0.8 && scale2 < 1.25) end.v *= std::sqrt(scale2);
        }
        end.v += on.vc + s * on.ac;
        end.P += s * (on.vc + 0.5 * s * on.ac);
        t.piece = std::min(2 * s, dt[t.i]);
        // What else may be in the way is looked for along the chord.
        if (s > 0) path.v = (end.P - path.P) / s;
        path.a.setZero();
    }
}

bool Collisions::may_reach_shape(std::size_t i, const Vec3d& from, const Vec3d& to, const Vec3d& a, double duration,
                                 std::size_t o) const
{
    const Obstacle& obstacle = obstacles_[o];
    if (obstacle.method != Method::Continuous || !obstacle.members[places_[i]]) return false;
    return may_reach(from, to, a, duration, obstacle.radius[places_[i]], obstacle.bounds);
}

// Whether a path may lead to a shape: one that the point is not on.
bool Collisions::may_meet(const Traveller& t, const Path& path, int o) const
{
    if ((t.supports > 0 && t.on[0].collider == o) || (t.supports > 1 && t.on[1].collider == o)) return false;
    return may_reach_shape(t.i, path.P, place(path, path.duration), path.a, path.duration, o);
}

// The first contact of each path, whichever shape it is with; of equally early ones, that with the first in the chain.
void Collisions::search()
{
    for (const std::uint32_t i : going_) obstacle_[i] = -1;
    for (std::size_t at = 0; at < obstacles_.size(); ++at) {  // a bounce may lead anywhere
        const int o = static_cast<int>(at);
        const Obstacle& obstacle = obstacles_[o];
        asked_.clear();
        asked_paths_.clear();
        for (const std::uint32_t i : going_) {
            if (travellers_[i].way == Traveller::Waits || !may_meet(travellers_[i], paths_[i], o)) continue;
            asked_.push_back(i);
            asked_paths_.push_back(paths_[i]);
            asked_paths_.back().radius = obstacle.radius[places_[i]];
            asked_paths_.back().begin = since_begin(i, travellers_[i].left);
            if (obstacle_[i] >= 0) asked_paths_.back().duration = contact_[i].time;
        }
        ask_first_contacts(o);
    }
}

void Collisions::ask_first_contacts(int o)
{
    if (asked_.empty()) return;
    answers_.resize(asked_.size());
    obstacles_[o].shape->first_contact(asked_paths_, answers_);
    for (std::size_t j = 0; j < asked_.size(); ++j) {
        const std::size_t i = asked_[j];
        if (answers_[j].time == Contact::none) continue;
        if (obstacle_[i] < 0)
            meeting_.push_back(static_cast<std::uint32_t>(i));
        else if (!(answers_[j].time < contact_[i].time))
            continue;
        obstacle_[i] = o;
        contact_[i] = answers_[j];
    }
}

// Takes a point to a contact on its path, and gives it the velocity that it leaves with.
//
// After a contact that leaves with the speed u, under the acceleration g into the surface, all further bounces together
// take 2u/(g (1 - ε)). Where they would be over within this sub-step the point rests from now on. The momentum that
// they would take from the tangent by friction is that of one contact with ε = 0 and the sliding after it, to the last
// digit: μ (1 + ε) |vn| (1 + ε + ε² + ...) = μ |vn| + μ g 2u/(g (1 - ε)).
void Collisions::meet(Traveller& t, const Vec3d& P, const Vec3d& v, const Vec3d& a, const Contact& contact, int o,
                      double dt)
{
    const Obstacle& obstacle = obstacles_[o];
    P_[t.i] = P;
    v_[t.i] = v;
    t.left -= contact.time;
    if (++t.events >= most_contacts) {
        ++limited;
        t.left = 0;
    }
    if (takes(t, contact, o)) return;
    if (contact.depth > 0) return leave_shape(t, contact, o, a);

    const double bounce = obstacle.response == Response::Slide ? 0.0 : double(obstacle.bounce[places_[t.i]]);
    const double friction = obstacle.friction[places_[t.i]];
    const Vec3d& n = contact.n;
    const Vec3d relative = v - contact.vc;
    const double vn = relative.dot(n);
    const Vec3d along = v - vn * n;
    const Vec3d ac = acceleration_of(obstacle, P, along, since_begin(t.i, t.left));
    const double g = -(a - ac).dot(n) - contact.curvature * (along - contact.vc).squaredNorm();
    const double u = vn < 0 ? -bounce * vn : vn;
    const double flush = flush_within(P, obstacle.radius[places_[t.i]], obstacle.feature * 0x1p-21);
    const double rising2 = g > 0 ? 2 * g * flush : 0;  // of a speed that lifts by less than rounding
    const bool hits = vn < 0 && vn * vn > rising2;
    const double when = consequences_.time - after_[t.i] - t.left;

    const Support support{o, n, contact.vc, contact.curvature, friction, contact.flat, obstacle.feature, ac};
    if (g < 0 && vn >= -tangential * relative.norm() && contact.flat) {
        // Flush with the surface, and drawn off it. (An approach by rounding alone would be met here again and again,
        // at the same moment.) What it rests on besides bears it still.
        v_[t.i] -= std::min(vn, 0.0) * n;
    } else if (g < 0 && vn >= -tangential * relative.norm()) {
        // As flush as a field knows: the next moments belong to the path.
        const double s = std::min(t.left, least_bending * dt);
        P_[t.i] += s * (v + 0.5 * s * a);
        v_[t.i] += s * a;
        t.left -= s;
        t.supports = 0;
    } else if (vn >= 0 || u * u <= rising2 || 2 * u <= g * (1 - bounce) * t.left) {
        settle(t, support, contact_response(v, contact.vc, n, 0, friction));
    } else {
        v_[t.i] = contact_response(v, contact.vc, n, bounce, friction);
        const double off = tangential * v_[t.i].norm();
        const auto leaves = [&](const Support& on) { return std::abs((v_[t.i] - on.vc).dot(on.n)) > off; };
        if (t.supports == 2 && leaves(t.on[1])) t.supports = 1;
        if (t.supports >= 1 && leaves(t.on[0])) t.on[0] = t.on[1], --t.supports;
        if (t.left == 0 && t.supports == 0) t.on[0] = support, t.supports = 1;
    }
    if (hits) count(t.i, P, n, contact.vc, -vn, v_[t.i] - v, when, o);
}

// Whether the shape keeps the point, or ends its life: its way is then over.
bool Collisions::takes(Traveller& t, const Contact& contact, int o)
{
    const Obstacle& obstacle = obstacles_[o];
    if (obstacle.response != Response::Stick && obstacle.response != Response::Die) return false;
    const std::size_t i = t.i;
    const Vec3d P = P_[i], v = v_[i];
    const double when = consequences_.time - after_[i] - t.left;
    if (contact.depth > 0) P_[i] += contact.depth * contact.n;
    v_[i] = contact.vc;
    count(i, P, contact.n, contact.vc, -(v - contact.vc).dot(contact.n), contact.vc - v, when, o);
    if (obstacle.response == Response::Die)
        consequences_.dead[places_[i]] = 1;
    else
        P_[i] += t.left * contact.vc;
    t.left = 0;
    t.supports = 1;
    t.on[0] = {o, contact.n, contact.vc, contact.curvature, 0, contact.flat, obstacle.feature};
    return true;
}

// A contact at this speed (m/s), which has changed the velocity.
void Collisions::count(std::size_t i, const Vec3d& P, const Vec3d& n, const Vec3d& vc, double speed,
                       const Vec3d& change, double time, int o)
{
    ++contacts;
    const std::optional<double>& record = obstacles_[o].record;
    if (record && speed >= *record)
        consequences_.hits->record(places_[i], P, n, vc, time, consequences_.mass[places_[i]] * change.norm(), o);
}

// The paper's methods: points that are in the shape at the end of the step are moved out of it (numerics.md,
// Collision). Where the field has no gradient they go back to where the step began.
void Collisions::correct(int o, std::span<const double> dt)
{
    const Obstacle& obstacle = obstacles_[o];
    asked_.clear();
    asked_P_.clear();
    asked_time_.clear();
    for (std::size_t i = 0; i < size_; ++i) {
        const double radius = obstacle.radius[places_[i]];
        if (!obstacle.members[places_[i]] || stuck_[i]) continue;
        if (is_clear_of(obstacle.bounds, P_[i], radius)) continue;
        asked_.push_back(i);
        asked_P_.push_back(P_[i]);
        asked_time_.push_back(since_begin(i, 0));
    }
    if (asked_.empty()) return;
    const auto ask = [&] {
        phi_.resize(asked_.size());
        gradients_.resize(asked_.size());
        obstacle.shape->distance_at(asked_P_, asked_time_, phi_, gradients_);
    };
    ask();

    std::size_t again = 0;
    for (std::size_t j = 0; j < asked_.size(); ++j) {
        const std::size_t i = asked_[j];
        const double slope = gradients_[j].norm();
        const double d = (obstacle.radius[places_[i]] - phi_[j]) / (slope > 0 ? slope : 1);
        if (!(d > 0)) continue;
        touch(i);
        const Vec3d at = P_[i], v = v_[i], vc = obstacle.shape->velocity_at(at, asked_time_[j]);
        const Vec3d n = detail::unit_normal(gradients_[j], v - vc);
        const double vn = (v - vc).dot(n);
        const double bounce = obstacle.response == Response::Slide ? 0.0 : double(obstacle.bounce[places_[i]]);
        const double friction = obstacle.friction[places_[i]];
        if (obstacle.response == Response::Die || obstacle.response == Response::Stick) {
            v_[i] = vc;
            P_[i] = slope > 0 ? Vec3d(at + d * n) : start_[i];
            if (obstacle.response == Response::Die) consequences_.dead[places_[i]] = 1;
        } else if (!(slope > 0)) {
            P_[i] = start_[i];
            v_[i] = contact_response(v, vc, n, bounce, friction);
        } else if (obstacle.method == Method::Project || !(vn < 0)) {
            P_[i] += d * n;
            v_[i] = contact_response(v, vc, n, bounce, friction);
            put_off_[i] = std::max(put_off_[i], (1 + bounce) * d);
        } else {
            const double back = std::min(d / -vn, dt[i]);
            const Vec3d& a = a_[i];
            const Vec3d after = contact_response(v - back * a, vc, n, bounce, friction);
            P_[i] += back * (after - v + back * a);
            put_off_[i] = std::max(put_off_[i], 0.5 * (1 + bounce) * back * back * a.norm());
            v_[i] = after + back * a;
            asked_time_[again] = asked_time_[j];
            asked_[again] = i;
            asked_P_[again++] = P_[i];
        }
        if (vn < 0) count(i, at, n, vc, -vn, v_[i] - v, consequences_.time - after_[i], o);
    }

    // Taken back by a time that the shape's curve makes inexact, a point may still be below the surface.
    asked_.resize(again);
    asked_P_.resize(again);
    asked_time_.resize(again);
    if (again == 0) return;
    ask();
    for (std::size_t j = 0; j < again; ++j) {
        const double slope2 = gradients_[j].squaredNorm(), d = obstacle.radius[places_[asked_[j]]] - phi_[j];
        if (d > 0 && slope2 > 0) P_[asked_[j]] += d / slope2 * gradients_[j];
    }
}

// The same within a piece along a curved surface, at whose chord the contact was found: the arc is off the chord by
// κ d²/2 u (1 - u).
void Collisions::meet_on_bend(Traveller& t, const Path& chord, const Bend& end, const Contact& contact, int o,
                              double dt)
{
    const double u = chord.duration > 0 ? contact.time / chord.duration : 0;
    Support& on = t.on[0];
    const Vec3d d = end.P - chord.P, v0 = v_[t.i];
    on.n = ((1 - u) * on.n + u * end.n).normalized();
    on.curvature = end.curvature;
    Vec3d v = (1 - u) * v0 + u * end.v - on.vc;
    v += on.vc - v.dot(on.n) * on.n;
    meet(t, chord.P + u * d + 0.5 * end.curvature * d.squaredNorm() * u * (1 - u) * on.n, v, end.a, contact, o, dt);
}

// Rests on one more surface: on one it slides, on two along their edge, on three nowhere. Two facets of one field are
// two surfaces where they make a valley, and the point lies in it: neither moving out of it nor drawn out.
void Collisions::settle(Traveller& t, const Support& support, const Vec3d& v)
{
    Vec3d along = tangential_to(support, v) - support.vc;
    bool again = t.supports > 0 && t.on[t.supports - 1].collider == support.collider;
    if (again && t.supports == 1) {
        const Vec3d& other = t.on[0].n;
        const Vec3d& a = a_[t.i];
        const Vec3d pull = a - a.dot(support.n) * support.n;
        again = along.dot(other) > valley * along.norm() || pull.dot(other) >= 0 || edge_of(t.on[0], support).isZero();
    }
    if (t.supports == 0 || again) {
        t.supports = std::max(t.supports, 1);
        t.on[t.supports - 1] = support;
    } else if (t.supports == 1 && !edge_of(t.on[0], support).isZero()) {
        t.on[1] = support;
        t.supports = 2;
    } else if (t.supports == 1) {
        t.on[0] = support;
    } else {
        along.setZero();
        t.left = 0;
    }
    if (t.supports == 2) {
        const Vec3d edge = edge_of(t.on[0], t.on[1]);
        along = along.dot(edge) * edge;
    }
    v_[t.i] = support.vc + along;
}

// A point that was born in a shape, or that a shape has swept over: out along the nearest way that is known, with the
// velocity that it has. Where it is then moving inwards it meets the surface as any other.
void Collisions::leave_shape(Traveller& t, const Contact& contact, int o, const Vec3d& a)
{
    t.supports = 0;
    const Vec3d before = P_[t.i];
    if (++t.rescues > most_rescues) {
        lost_.push_back(t.i);
        t.left = 0;
    } else if (!contact.n.isZero()) {
        P_[t.i] += contact.depth * contact.n;
    } else if (contact.back != Contact::none) {
        P_[t.i] -= contact.back * (v_[t.i] - contact.vc);
    } else {
        // It has not come in by itself: out against what pulls, or upwards.
        const double pull = a.norm();
        const Vec3d down = pull > 0 ? Vec3d(a / pull) : Vec3d(-Vec3d::UnitY());
        const Path fall{
            P_[t.i], contact.vc + down, Vec3d::Zero(), 0, obstacles_[o].radius[places_[t.i]], since_begin(t.i, t.left)};
        Contact above;
        obstacles_[o].shape->first_contact({&fall, 1}, {&above, 1});
        if (above.back == Contact::none) {
            lost_.push_back(t.i);
            t.left = 0;
        } else {
            P_[t.i] -= above.back * down;
        }
    }
    put_out_.push_back({t.i, P_[t.i] - before});
}

// The path is free up to its end.
void Collisions::proceed(Traveller& t, const Path& path, const Bend& end)
{
    Support& on = t.on[0];
    if (t.way == Traveller::Curved) {
        P_[t.i] = end.P;
        v_[t.i] = end.v;
        on.n = end.n;
        on.curvature = end.curvature;
    } else {
        P_[t.i] = place(path, path.duration);
        v_[t.i] = path.v + path.duration * path.a;
    }
    t.left -= path.duration;
    if (t.supports > 0 && !on.ac.isZero(0)) {
        const Obstacle& obstacle = obstacles_[on.collider];
        const double now = since_begin(t.i, t.left);
        on.vc = obstacle.shape->velocity_at(P_[t.i], now);
        on.ac = acceleration_of(obstacle, P_[t.i], t.stops ? on.vc : v_[t.i], now);
    }
    if (t.stops) v_[t.i] = on.vc;
    if (t.supports == 2 && !(on.flat && t.on[1].flat)) t.supports = 0;
}

void Collisions::finish(const Traveller& t)
{
    for (int k = 0; k < 2; ++k) surfaces_[t.i][k] = k < t.supports ? Surface{t.on[k].collider, t.on[k].n} : no_surface;
}

// Calls use(i, surface, f, flush) for the points that are on a surface and have moved, with f = distance - radius at
// place(i). Surfaces of an edge come one after the other.
template <class Place, class Use>
void Collisions::ask_surfaces(const Place& place, const Use& use)
{
    for (int side = 0; side < 2; ++side) {
        for (std::size_t o = 0; o < obstacles_.size(); ++o) {
            const Obstacle& obstacle = obstacles_[o];
            const std::vector<std::uint32_t>& moved = moved_on_[side][o];
            if (moved.empty()) continue;
            asked_P_.clear();
            for (const std::uint32_t i : moved) asked_P_.push_back(place(i));
            phi_.resize(moved.size());
            obstacle.shape->distance(asked_P_, phi_, {});
            for (std::size_t j = 0; j < moved.size(); ++j) {
                const std::uint32_t i = moved[j];
                const double f = phi_[j] - obstacle.radius[places_[i]];
                use(i, surfaces_[i][side], f, flush_of_way(i, asked_P_[j], obstacle));
            }
        }
    }
}

// How near to a surface its end is flush with it: by the way's coordinates, as those of the end may be 0.
double Collisions::flush_of_way(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const
{
    const Vec3d largest = P.cwiseAbs().cwiseMax(before_[i].cast<double>().cwiseAbs());
    return flush_within(largest, obstacle.radius[places_[i]], obstacle.feature * 0x1p-21);
}

double Collisions::over_plane(std::size_t i, const Vec3d& P) const
{
    const Obstacle& obstacle = obstacles_[plane_[i]];
    return obstacle.plane->n.dot(P) - obstacle.plane->offset - obstacle.radius[places_[i]];
}

// To nearest, which can leave a point on the inner side of its surface by half an ulp an axis. Then the coordinate that
// matters most is moved until the point is out again: by the least that is enough. A point that has not moved keeps its
// bits, so that nothing creeps.
double Collisions::round(std::span<Vec3d> P, std::span<Vec3f> rounded)
{
    for (auto& side : moved_on_)
        for (std::vector<std::uint32_t>& moved : side) moved.clear();
    moved_on_plane_.clear();
    for (const std::uint32_t i : touched_) {
        before_[i] = rounded[i];
        const std::array<Surface, 2>& on = surfaces_[i];
        if (on[0].obstacle < 0 || (P[i] == before_[i].cast<double>() && !obstacles_[on[0].obstacle].moves)) continue;
        if (plane_[i] >= 0) {
            if (plane_[i] == on[0].obstacle) moved_on_plane_.push_back(i);
            continue;
        }
        for (int side = 0; side < 2 && on[side].obstacle >= 0; ++side) moved_on_[side][on[side].obstacle].push_back(i);
    }

    // First onto the surface as far as double goes: what the way there has left of rounding is not to be seen.
    ask_surfaces([&](std::size_t i) { return P[i]; },
                 [&](std::size_t i, const Surface& surface, double f, double flush) {
                     // How a moving shape turns and speeds up within a step is not in the way of what rests on it.
                     const Obstacle& obstacle = obstacles_[surface.obstacle];
                     const double h = consequences_.h;
                     const auto speed = [&](double time) { return obstacle.shape->velocity_at(P[i], time).norm(); };
                     const double drawn = obstacle.moves ? h * (speed(0) + speed(h)) : 0;
                     if (std::abs(f) <= flush + drawn) P[i] -= f * surface.n;
                 });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = obstacles_[plane_[i]];
        const double f = over_plane(i, P[i]);
        if (std::abs(f) <= flush_of_way(i, P[i], obstacle)) P[i] -= f * obstacle.plane->n;
    }
    const bool moves = std::any_of(obstacles_.begin(), obstacles_.end(), [](const Obstacle& o) { return o.moves; });
    std::sort(lost_.begin(), lost_.end());
    lost_.erase(std::unique(lost_.begin(), lost_.end()), lost_.end());
    take_out(P, moves ? touched_ : lost_);
    cast(std::span<const Vec3d>(P), rounded);
    ask_surfaces([&](std::size_t i) { return Vec3d(rounded[i].cast<double>()); },
                 [&](std::size_t i, const Surface& surface, double f, double flush) {
                     if (f < 0 && f >= -flush) rounded[i] = lifted(rounded[i], surface.n, -f);
                 });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = obstacles_[plane_[i]];
        const Vec3d at = rounded[i].cast<double>();
        const double f = over_plane(i, at);
        if (f < 0 && f >= -flush_of_way(i, at, obstacle)) rounded[i] = lifted(rounded[i], obstacle.plane->n, -f);
    }
    return deepest(rounded);
}

// Parts of a body that meet one another, or two bodies, leave no place to a point between them: at the end of the frame
// it is brought out of both, with the velocity that it has. By the nearest way; and where that leads from one side of a
// closed gap to the other, to the nearest place that is free.
void Collisions::take_out(std::span<Vec3d> P, std::vector<std::uint32_t> inside)
{
    std::vector<std::uint32_t> still;
    for (int tries = 0; !inside.empty() && tries < most_rescues; ++tries) {
        const bool closed = tries >= most_rescues / 2;
        still.clear();
        for (const Obstacle& obstacle : obstacles_) {
            if (obstacle.method != Method::Continuous) continue;
            asked_.clear();
            asked_P_.clear();
            for (const std::uint32_t i : inside) {
                if (!obstacle.members[places_[i]]) continue;
                if (is_clear_of(obstacle.bounds, P[i], obstacle.radius[places_[i]])) continue;
                asked_.push_back(i);
                asked_P_.push_back(P[i]);
            }
            if (asked_.empty()) continue;
            phi_.resize(asked_.size());
            gradients_.resize(asked_.size());
            obstacle.shape->distance(asked_P_, phi_, gradients_);
            for (std::size_t j = 0; j < asked_.size(); ++j) {
                const std::size_t i = asked_[j];
                const double f = phi_[j] - obstacle.radius[places_[i]], slope2 = gradients_[j].squaredNorm();
                if (f >= -flush_within(P[i], obstacle.radius[places_[i]], obstacle.feature * 0x1p-21)) continue;
                if (slope2 > 0 && !closed)
                    P[i] -= f / slope2 * gradients_[j];
                else
                    P[i] = place_outside(obstacle, P[i], obstacle.radius[places_[i]]);
                still.push_back(static_cast<std::uint32_t>(i));
            }
        }
        std::sort(still.begin(), still.end());
        still.erase(std::unique(still.begin(), still.end()), still.end());
        inside.swap(still);
    }
    trapped += inside.size();
}

double Collisions::deepest(std::span<const Vec3f> P)
{
    double depth = 0;
    for (const std::uint32_t i : touched_)
        if (plane_[i] >= 0) depth = std::max(depth, -over_plane(i, P[i].cast<double>()));
    for (const Obstacle& obstacle : obstacles_) {
        asked_.clear();
        asked_P_.clear();
        for (const std::uint32_t i : touched_) {
            if (plane_[i] >= 0 || !obstacle.members[places_[i]]) continue;
            const double radius = obstacle.radius[places_[i]];
            const Vec3d at = P[i].cast<double>();
            if (is_clear_of(obstacle.bounds, at, radius)) continue;
            asked_.push_back(i);
            asked_P_.push_back(at);
        }
        if (asked_.empty()) continue;
        phi_.resize(asked_.size());
        obstacle.shape->distance(asked_P_, phi_, {});
        for (std::size_t j = 0; j < asked_.size(); ++j)
            depth = std::max(depth, obstacle.radius[places_[asked_[j]]] - phi_[j]);
    }
    return depth;
}

void keep_outside(std::span<const Obstacle> obstacles, std::span<const std::uint32_t> places, std::span<const Vec3d> P,
                  std::span<std::uint8_t> marks)
{
    for (const Obstacle& obstacle : obstacles) {
        std::vector<std::size_t> asked;
        std::vector<Vec3d> at;
        for (std::size_t i = 0; i < places.size(); ++i) {
            if (!marks[i] || !obstacle.members[places[i]]) continue;
            const Vec3d x = P[i].cast<float>().cast<double>();
            if (is_clear_of(obstacle.bounds, x, obstacle.radius[places[i]])) continue;
            asked.push_back(i);
            at.push_back(x);
        }
        if (asked.empty()) continue;
        std::vector<double> phi(asked.size());
        obstacle.shape->distance(at, phi, {});
        for (std::size_t j = 0; j < asked.size(); ++j)
            if (!(phi[j] > obstacle.radius[places[asked[j]]])) marks[asked[j]] = 0;
    }
}

}  // namespace rapid

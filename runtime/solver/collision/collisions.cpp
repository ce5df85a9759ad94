#include "runtime/solver/collision/collisions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/shapes/first_contact.h"
#include "runtime/solver/collision/response.h"

namespace rapid {

void DiscreteMethods::begin()
{
    is_used_ = std::any_of(block_.obstacles.begin(), block_.obstacles.end(),
                           [](const Obstacle& obstacle) { return !obstacle.is_continuous(); });
    position_error_.assign(block_.size(), 0);
}

void DiscreteMethods::correct()
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (!block_.obstacles[o].is_continuous()) correct(static_cast<int>(o));
}

void DiscreteMethods::correct(int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    query_obstacle(obstacle);
    if (query_.empty()) return;
    query_.find_gradients_at_times(*obstacle.shape);
    std::size_t backtracked = 0;
    for (std::size_t j = 0; j < query_.size(); ++j)
        if (move_out(j, o)) query_.move(j, backtracked++);
    query_.truncate(backtracked);
    if (!query_.empty()) lift(obstacle);
}

void DiscreteMethods::query_obstacle(const Obstacle& obstacle)
{
    query_.clear();
    for (std::size_t i = 0; i < block_.size(); ++i) {
        if (!block_.has_member(obstacle, i) || stuck_.has(i)) continue;
        if (obstacle.is_clear_of(block_.P[i], block_.radius(obstacle, i))) continue;
        query_.add(i, block_.P[i], block_.frame_time(i, 0));
    }
}

// Moves a point out of an obstacle. If the field has no gradient, the point returns to its position at the beginning
// of the step. Returns true if the point was backtracked; the query then holds its new position.
bool DiscreteMethods::move_out(std::size_t j, int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::size_t i = query_.point[j];
    const double slope = query_.gradient[j].norm();
    const double depth = (block_.radius(obstacle, i) - query_.phi[j]) / (slope > 0 ? slope : 1);
    if (!(depth > 0)) return false;
    touched_.add(i);
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const Vec3d P0 = P, v0 = v, vc = obstacle.shape->velocity_at(P0, query_.time[j]);
    const Vec3d n = unit_normal(query_.gradient[j], v0 - vc);
    const double vn = (v0 - vc).dot(n);
    const double bounce = obstacle.restitution(block_.indices[i]), friction = obstacle.friction[block_.indices[i]];
    bool backtracked = false;
    if (obstacle.response == Response::Die || (obstacle.sticks() && !stuck_.is_torn(i, o))) {
        v = vc;
        P = slope > 0 ? Vec3d(P0 + depth * n) : initial_P_[i];
        if (obstacle.response == Response::Die) block_.context.kill(block_.indices[i], block_.time(i, 0));
        if (obstacle.sticks()) stuck_.hold(i, o, 0);
    } else if (!(slope > 0)) {
        P = initial_P_[i];
        v = contact_response(v0, vc, n, bounce, friction);
    } else if (obstacle.method == Method::Project || !(vn < 0)) {
        P += depth * n;
        v = contact_response(v0, vc, n, bounce, friction);
        position_error_[i] = std::max(position_error_[i], (1 + bounce) * depth);
    } else {
        backtrack(i, obstacle, vc, query_.time[j], n, depth);
        query_.P[j] = P;
        backtracked = true;
    }
    if (vn < 0) audit_.add(static_cast<std::size_t>(i), o, {P0, n, vc, -vn, v0, v - v0, block_.time(i, 0)});
    return backtracked;
}

// Moves back along the velocity to the surface, then forward with the velocity after the contact. vc, time: of the
// surface, at the end of the step.
void DiscreteMethods::backtrack(std::size_t i, const Obstacle& obstacle, const Vec3d& vc, double time, const Vec3d& n,
                                double depth)
{
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const double bounce = obstacle.restitution(block_.indices[i]), friction = obstacle.friction[block_.indices[i]];
    const double back = std::min(depth / -(v - vc).dot(n), block_.dt[i]);
    const Vec3d& a = motion_.acceleration(i);
    const Vec3d vc_then = obstacle.shape->velocity_at(P, time - back);
    const Vec3d after = contact_response(v - back * a, vc_then, n, bounce, friction);
    P += back * (after - v + back * a);
    position_error_[i] = std::max(position_error_[i], 0.5 * (1 + bounce) * back * back * a.norm());
    v = after + back * a;
}

// Lifts points that are still below the surface, because a curved shape makes the backtracking time inexact.
void DiscreteMethods::lift(const Obstacle& obstacle)
{
    query_.find_gradients_at_times(*obstacle.shape);
    for (std::size_t j = 0; j < query_.size(); ++j) {
        const std::size_t i = query_.point[j];
        const double slope2 = query_.gradient[j].squaredNorm(), depth = block_.radius(obstacle, i) - query_.phi[j];
        if (depth > 0 && slope2 > 0) block_.P[i] += depth / slope2 * query_.gradient[j];
    }
}

void Collisions::begin(std::span<const std::uint32_t> indices)
{
    block_.indices = indices;
    touched_.begin();
    audit_.begin();
    ejection_.begin();
    stuck_.begin();
    broad_phase_.begin();
    contacts_.begin();
    discrete_.begin();
    planes_.begin(discrete_.is_used());
    rounding_.begin();
}

void Collisions::advance(std::span<Vec3d> P, std::span<Vec3d> v, const Drift& drift)
{
    block_.P = P;
    block_.v = v;
    block_.dt = drift.dt;
    block_.after = drift.after;
    motion_.begin(drift);
    if (motion_.is_damped()) audit_.begin_work();
    const std::size_t displaced = ejection_.displacements().size();
    if (discrete_.is_used()) discrete_.begin_substep();
    stuck_.advance();
    audit_.add_carried(stuck_, motion_);
    move_along_free_paths();
    rounds_.run();
    stuck_.finish(contacts_.found());
    if (discrete_.is_used()) correct();
    if (motion_.is_damped()) {
        limit_energy(displaced);
        audit_.count_work(touched_);
        audit_.add_displacements(ejection_.displacements().subspan(displaced), motion_);
    } else {
        audit_.add_energy(touched_, stuck_, motion_);
    }
}

// Between contacts, the mean acceleration represents springs. If springs turn a point several times in the substep, its
// energy may come out arbitrary. The energy is therefore limited to the point's initial energy, plus the work of
// displacements and of moving shapes. A position beyond that energy is rejected, and the point waits at its initial
// position. Its energy change is then the work of contacts; drag, which may have taken part of it, adds none.
void Collisions::limit_energy(std::size_t displaced)
{
    constexpr double rounding = 1e-12;
    const auto moved = ejection_.displacements().subspan(displaced);
    for (const std::uint32_t i : touched_.list()) {
        if (stuck_.has(i) || !motion_.is_drawn(i)) continue;
        Vec3d &P = block_.P[i], &v = block_.v[i], by = Vec3d::Zero();
        for (const Ejection::Displacement& one : moved)
            if (one.i == i) by += one.by;
        // The frame is that of the shape that a spring attaches the point to, which moves with V.
        const Vec3d from = motion_.initial_P(i) + by, V = motion_.frame_velocity(i, from),
                    displacement = block_.dt[i] * V;
        const Vec3d v0 = motion_.initial_v(i) - V;
        const double energy = 0.5 * v0.squaredNorm() + motion_.potential(i, from);
        const double speed = speed_of_shapes(i, from, V);
        const double most = speed > 0 ? driven_energy(i, from, energy, speed) : energy;
        double potential = motion_.potential(i, P - displacement);
        if (most - potential < -rounding * (0.5 * v0.squaredNorm() + std::abs(potential))) {
            P = from + displacement;
            potential = motion_.potential(i, from);
            if (!(speed > 0)) v = v0 + V;
        }
        const double kinetic = std::max(0.0, most - potential);
        Vec3d u = v - V;
        if (0.5 * u.squaredNorm() > kinetic) {
            u *= std::sqrt(2 * kinetic / u.squaredNorm());
            v = V + u;
        }
        const double work = 0.5 * u.squaredNorm() + potential - energy;
        audit_.set_work(i, motion_.is_dragged(i) ? std::max(audit_.work_now(i), work) : work);
    }
}

// Returns the largest speed of a shape, m/s, relative to a frame that moves with V, in the region that the spring may
// take the point to: between its position and the same distance beyond the spring's center.
double Collisions::speed_of_shapes(std::size_t i, const Vec3d& from, const Vec3d& V) const
{
    constexpr double rounding = 1e-9;
    const Damped::Pull& pull = motion_.pull(i);
    const Vec3d to = pull.w2 > 0 ? Vec3d(from + 2 / pull.w2 * pull.G) : from;
    double fastest = 0;
    for (const Obstacle& obstacle : block_.obstacles) {
        if (!block_.has_member(obstacle, i)) continue;
        for (const Vec3d& P : {from, to}) {
            Vec3d vc = Vec3d::Zero();
            if (obstacle.moves) vc = obstacle.shape->velocity_at(P, block_.frame_time(i, 0));
            const double speed = (vc - V).norm();
            if (speed > rounding * V.norm()) fastest = std::max(fastest, speed);
        }
    }
    return fastest;
}

// Returns an upper bound of the energy of a point on a spring after shapes of the speed V have met it, J/kg. Each time
// the spring brings it back, they give it at most twice their speed, and they push it V t against the spring:
//
//   √(2E) <= √(2E0) + 2V (1 + Ωt)          E above the least potential energy
//
// The minimum is at the balance of forces or, for a spring to a surface, as far as the point may move along it. If the
// spring turns the point by less than a radian in the substep, the mean acceleration is accurate and no bound is
// needed.
double Collisions::driven_energy(std::size_t i, const Vec3d& from, double energy, double speed) const
{
    constexpr double unbounded = std::numeric_limits<double>::infinity();
    const Damped::Pull& pull = motion_.pull(i);
    const double turns = std::sqrt(pull.w2 + pull.surface.w2) * block_.dt[i];
    if (!(turns > 1)) return unbounded;
    const double kicks = 2 * speed * (1 + turns);
    double least = 0;
    if (pull.w2 > 0) {
        least = -0.5 * pull.G.squaredNorm() / pull.w2;
    } else {
        const double G = pull.G.norm(), t = block_.dt[i], gained = pull.G.dot(from - motion_.initial_P(i));
        least = -gained - G * t * (std::sqrt(2 * std::max(0.0, energy + gained)) + kicks + G * t);
    }
    const double root = std::sqrt(2 * std::max(0.0, energy - least)) + kicks;
    return least + 0.5 * root * root;
}

// Applies the paper's methods, which correct after the substep.
void Collisions::correct()
{
    if (!motion_.is_damped()) return discrete_.correct();
    const std::vector<Vec3d> P(block_.P.begin(), block_.P.end()), v(block_.v.begin(), block_.v.end());
    discrete_.correct();
    audit_.add_corrections(P, v, motion_);
}

// Moves points to the end of the substep if they meet nothing.
void Collisions::move_along_free_paths()
{
    motion_.trace();
    contacts_.clear();
    broad_phase_.find(motion_.paths());
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) find_first_contacts(o);

    // All points go to the ends of their free paths. Those that are stuck, or meet something, go back.
    motion_.go_to_ends();
    for (const std::uint32_t i : stuck_.list()) motion_.go_back(i);
    for (const StuckPoints::Loose& loose : stuck_.loose()) {
        motion_.go_back(loose.i);
        rounds_.resume(loose.i, loose.left, loose.on);
    }
    for (const std::uint32_t i : contacts_.found()) {
        motion_.go_back(i);
        touched_.add(i);
        if (!planes_.slides_on_plane(i)) rounds_.start(i);
    }
}

void Collisions::find_first_contacts(std::size_t o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const bool is_plane = obstacle.plane && !motion_.is_damped() && !obstacle.clings();
    for (const std::uint32_t i : broad_phase_.points_near(o)) {
        if (!block_.has_member(obstacle, i) || stuck_.takes(i)) continue;
        if (is_plane && broad_phase_.obstacles_near(i) == 1) {
            planes_.add(i, o);
        } else {
            touched_.set_only_plane(i, -1);
            contacts_.add(i, motion_.path(i, block_.radius(obstacle, i)));
        }
    }
    planes_.finish(o);
    contacts_.query(o);
}

double Collisions::round(std::span<Vec3d> P, std::span<Vec3f> rounded)
{
    rounding_.snap(P, rounded);
    correction_.run(P, ejection_.lost());
    audit_.add_final_corrections(P, correction_.displacements(), motion_);
    cast(std::span<const Vec3d>(P), rounded);
    rounding_.lift(rounded);
    stuck_.keep(rounded);
    return correction_.deepest(rounded);
}

}  // namespace rapid

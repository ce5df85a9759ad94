#include "runtime/solver/collision/collisions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/shapes/first_contact.h"
#include "runtime/solver/collision/obstacle.h"

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

namespace {

// Returns a position outside a shape, at most a little farther away than the nearest in any of 26 directions; P if
// there is none.
Vec3d free_position(const Obstacle& obstacle, const Vec3d& P, double radius)
{
    const double size = obstacle.bounds.sizes().maxCoeff() + 2 * radius;
    if (!std::isfinite(size)) return P;
    std::array<Vec3d, 26> candidates;
    std::array<double, 26> phi;
    for (double reach = std::max(obstacle.feature, 0x1p-10 * size); reach < 2 * size; reach *= 1.25) {
        for (int k = 0, direction = 0; k < 27; ++k) {
            const Vec3d d(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
            if (!d.isZero()) candidates[direction++] = P + reach * d.normalized();
        }
        obstacle.shape->distance(candidates, phi, {});
        const auto highest = std::max_element(phi.begin(), phi.end());
        if (*highest >= radius) return candidates[highest - phi.begin()];
    }
    return P;
}

void sort_unique(std::vector<std::uint32_t>& points)
{
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
}

}  // namespace

void PenetrationCorrection::run(std::span<Vec3d> P, const std::vector<std::uint32_t>& lost)
{
    const bool any_moves = std::any_of(block_.obstacles.begin(), block_.obstacles.end(),
                                       [](const Obstacle& obstacle) { return obstacle.moves; });
    inside_ = any_moves ? touched_.list() : lost;
    if (!any_moves) sort_unique(inside_);
    displacements_.clear();
    for (int tries = 0; !inside_.empty() && tries < max_ejections; ++tries) {
        still_inside_.clear();
        for (const Obstacle& obstacle : block_.obstacles)
            if (obstacle.is_continuous()) move_out(obstacle, P, tries >= max_ejections / 2);
        sort_unique(still_inside_);
        inside_.swap(still_inside_);
    }
    audit_.add_trapped(inside_.size());
}

// Moves the points of inside_ that are in this obstacle out of it.
void PenetrationCorrection::move_out(const Obstacle& obstacle, std::span<Vec3d> P, bool to_free_position)
{
    query_.clear();
    for (const std::uint32_t i : inside_)
        if (block_.has_member(obstacle, i) && !obstacle.is_clear_of(P[i], block_.radius(obstacle, i)))
            query_.add(i, P[i]);
    if (query_.empty()) return;
    query_.find_gradients(*obstacle.shape);
    for (std::size_t j = 0; j < query_.size(); ++j) {
        const std::uint32_t i = query_.point[j];
        const double radius = block_.radius(obstacle, i);
        const double f = query_.phi[j] - radius, slope2 = query_.gradient[j].squaredNorm();
        if (f >= -obstacle.contact_tolerance(P[i], radius)) continue;
        const Vec3d before = P[i];
        if (slope2 > 0 && !to_free_position)
            P[i] -= f / slope2 * query_.gradient[j];
        else
            P[i] = free_position(obstacle, P[i], radius);
        displacements_.push_back({i, P[i] - before});
        still_inside_.push_back(i);
    }
}

double PenetrationCorrection::deepest(std::span<const Vec3f> P)
{
    double depth = 0;
    for (const std::uint32_t i : touched_.list())
        if (const int plane = touched_.only_plane(i); plane >= 0)
            depth = std::max(depth, -block_.height_over_plane(i, block_.obstacles[plane], P[i].cast<double>()));
    for (const Obstacle& obstacle : block_.obstacles) {
        query_.clear();
        for (const std::uint32_t i : touched_.list()) {
            if (touched_.only_plane(i) >= 0 || !block_.has_member(obstacle, i)) continue;
            const Vec3d at = P[i].cast<double>();
            if (!obstacle.is_clear_of(at, block_.radius(obstacle, i))) query_.add(i, at);
        }
        if (query_.empty()) continue;
        query_.find_distances(*obstacle.shape);
        for (std::size_t j = 0; j < query_.size(); ++j)
            depth = std::max(depth, block_.radius(obstacle, query_.point[j]) - query_.phi[j]);
    }
    return depth;
}

namespace {

// Moves the coordinate with the largest normal component by the least amount that lifts the point by `height`.
Vec3f lifted(Vec3f P, const Vec3d& n, double height)
{
    int k;
    n.cwiseAbs().maxCoeff(&k);
    const double target = P[k] + height / n[k];
    const float outward = std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(n[k]));
    P[k] = static_cast<float>(target);
    if (n[k] > 0 ? P[k] < target : P[k] > target) P[k] = std::nextafter(P[k], outward);
    return P;
}

}  // namespace

void PositionRounding::find_moved(std::span<const Vec3d> P, std::span<const Vec3f> initial)
{
    for (auto& side : moved_on_)
        for (std::vector<std::uint32_t>& moved : side) moved.clear();
    moved_on_plane_.clear();
    for (const std::uint32_t i : touched_.list()) {
        initial_P_[i] = initial[i];
        const TouchedPoints::Surfaces& on = touched_.surfaces(i);
        const int first = on[0].obstacle, plane = touched_.only_plane(i);
        if (first < 0 || (P[i] == initial[i].cast<double>() && !block_.obstacles[first].moves)) continue;
        if (plane >= 0) {
            if (plane == first) moved_on_plane_.push_back(i);
            continue;
        }
        for (int side = 0; side < 2 && on[side].obstacle >= 0; ++side) moved_on_[side][on[side].obstacle].push_back(i);
    }
}

// Calls use(i, surface, f, tolerance) for points that have moved on a surface, with f = distance - radius at
// position(i). The two surfaces of an edge are processed one after the other.
template <class Position, class Use>
void PositionRounding::query_surfaces(const Position& position, const Use& use)
{
    for (int side = 0; side < 2; ++side) {
        for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
            const Obstacle& obstacle = block_.obstacles[o];
            if (moved_on_[side][o].empty()) continue;
            query_.clear();
            for (const std::uint32_t i : moved_on_[side][o]) query_.add(i, position(i));
            query_.find_distances(*obstacle.shape);
            for (std::size_t j = 0; j < query_.size(); ++j) {
                const std::uint32_t i = query_.point[j];
                const double f = query_.phi[j] - block_.radius(obstacle, i);
                use(i, touched_.surfaces(i)[side], f, tolerance(i, query_.P[j], obstacle));
            }
        }
    }
}

// Returns the contact tolerance for the largest coordinates of the path, because those of its end may be 0.
double PositionRounding::tolerance(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const
{
    const Vec3d largest = P.cwiseAbs().cwiseMax(initial_P_[i].cast<double>().cwiseAbs());
    return obstacle.contact_tolerance(largest, block_.radius(obstacle, i));
}

void PositionRounding::snap(std::span<Vec3d> P, std::span<const Vec3f> initial)
{
    find_moved(P, initial);
    query_surfaces([&](std::size_t i) { return P[i]; },
                   [&](std::size_t i, const TouchedPoints::Surface& surface, double f, double tolerance) {
                       // The path of a point on a moving shape ignores the turning and acceleration of the shape within
                       // a step.
                       const Obstacle& obstacle = block_.obstacles[surface.obstacle];
                       const double h = block_.context.h;
                       const auto speed = [&](double time) { return obstacle.shape->velocity_at(P[i], time).norm(); };
                       const double carried = obstacle.moves ? h * (speed(0) + speed(h)) : 0;
                       if (std::abs(f) <= tolerance + carried) P[i] -= f * surface.n;
                   });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = block_.obstacles[touched_.only_plane(i)];
        const double f = block_.height_over_plane(i, obstacle, P[i]);
        if (std::abs(f) <= tolerance(i, P[i], obstacle)) P[i] -= f * obstacle.plane->n;
    }
}

void PositionRounding::lift(std::span<Vec3f> rounded)
{
    query_surfaces([&](std::size_t i) { return Vec3d(rounded[i].cast<double>()); },
                   [&](std::size_t i, const TouchedPoints::Surface& surface, double f, double tolerance) {
                       if (f < 0 && f >= -tolerance) rounded[i] = lifted(rounded[i], surface.n, -f);
                   });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = block_.obstacles[touched_.only_plane(i)];
        const Vec3d P = rounded[i].cast<double>();
        const double f = block_.height_over_plane(i, obstacle, P);
        if (f < 0 && f >= -tolerance(i, P, obstacle)) rounded[i] = lifted(rounded[i], obstacle.plane->n, -f);
    }
}

}  // namespace rapid

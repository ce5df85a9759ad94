#include "runtime/solver/collision/collisions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rapid {

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

// Between contacts, the mean acceleration represents springs. If springs turn a point several times in the substep,
// its energy may come out arbitrary. The energy is therefore limited to what the point had, plus the work of
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
        // As seen from the shape that a spring attaches the point to, which moves with V.
        const Vec3d from = motion_.initial_P(i) + by, V = motion_.frame_velocity(i, from), way = block_.dt[i] * V;
        const Vec3d v0 = motion_.initial_v(i) - V;
        const double energy = 0.5 * v0.squaredNorm() + motion_.potential(i, from);
        const double speed = speed_of_shapes(i, from, V);
        const double most = speed > 0 ? driven_energy(i, from, energy, speed) : energy;
        double potential = motion_.potential(i, P - way);
        if (most - potential < -rounding * (0.5 * v0.squaredNorm() + std::abs(potential))) {
            P = from + way;
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
    contacts_.ask(o);
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

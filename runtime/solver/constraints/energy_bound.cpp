#include "runtime/solver/constraints/energy_bound.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/base/parallel.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {
namespace {

// Relative difference below which energies are equal within rounding.
constexpr double energy_rounding = 1e-12;

// A gain above this fraction of the available energy means that rods and springs have found no solution.
constexpr double largest_gain = 0.5;

template <class F>
void for_each_moving(const Substep& step, const F& f)
{
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (step.points[i].w > 0 && step.inverse_mass[i] > 0) f(i);
    });
}

// Returns the largest t in [0, 1] with slope t + curvature t² + change <= 0 or, if none exists, the t with the
// smallest value.
double largest_part(double slope, double curvature, double change)
{
    const double root2 = slope * slope - 4 * curvature * change;
    if (!(curvature > 0)) return 1;
    if (!(root2 > 0)) return std::clamp(-0.5 * slope / curvature, 0.0, 1.0);
    return std::clamp((-slope + std::sqrt(root2)) / (2 * curvature), 0.0, 1.0);
}

// Returns an upper bound, J, of the energy that forces can give a point in a substep, accelerating it from rest or
// towards the spring's center.
double available_work(const Substep& step, std::size_t i, const Vec3d& P)
{
    const bool own = !step.mobility.empty();
    const double stiffness = own ? step.mobility[i].stiffness : 0;
    const Vec3d a = (own ? step.mobility[i].pull : step.acceleration) - stiffness * P;
    double work = a.squaredNorm() * (stiffness > 0 ? 0.5 / stiffness : step.dt * step.dt);
    if (own && step.surface_springs[i].w2 > 0) work += potential_energy(step.surface_springs[i], P);
    return work / step.inverse_mass[i];
}

}  // namespace

// A point that does not move separates the points linked to it, like a wall, and drives them.
void EnergyIslands::link(std::span<const std::uint32_t> points)
{
    const auto moves = [&](std::uint32_t i) { return step_.points[i].w > 0; };
    // Sleepers rest, whatever velocity they fell asleep with.
    const auto rests = [&](std::uint32_t i) { return step_.points[i].P == step_.start[i]; };
    const auto v_before = [&](std::uint32_t i) {
        const bool is_carried = !step_.carried_v.empty() && !step_.carried_v[i].isZero(0);
        return is_carried ? step_.carried_v[i] : step_.v[i];
    };
    const auto first = std::find_if(points.begin(), points.end(), moves);
    if (first == points.end()) return;
    for (const std::uint32_t i : points)
        if (moves(i))
            sets_.join(*first, i);
        else
            drivers_.push_back({*first, i, rests(i) ? Drive{} : Drive::of(v_before(i), step_.v[i], step_.dt),
                                step_.spins.empty() ? 0 : step_.spins[i].s.norm()});
}

void EnergyIslands::close()
{
    driven_.assign(step_.size(), {});
    for (Driver& driver : drivers_) {
        if (driver.point < kinematic_.size() && kinematic_[driver.point]) driver.by = *kinematic_[driver.point];
        Driven& island = driven_[root(driver.i)];
        island.mean.v += driver.by.v, island.mean.displacement += driver.by.displacement;
        island.moves |= !driver.by.v.isZero(0) || !driver.by.displacement.isZero(0) || driver.rolling > 0;
        any_moves_ |= island.moves;
        ++island.drivers;
    }
    for (Driven& island : driven_)
        if (island.drivers > 1) island.mean.v /= island.drivers, island.mean.displacement /= island.drivers;
    for (const Driver& driver : drivers_) {
        Driven& island = driven_[root(driver.i)];
        if (!island.moves) continue;
        island.spread = std::max({island.spread, (driver.by.v - island.mean.v).norm() + driver.rolling,
                                  (driver.by.displacement - island.mean.displacement).norm() / step_.dt});
    }
}

void EnergyBound::keep(const Substep& step)
{
    v_.resize(step.size());
    change_.assign(step.size(), 0.0);
    stored_.assign(step.size(), 0.0);
    stored_in_frame_.clear();
    credit_.assign(step.energy.size(), 0.0);
    P_.resize(step.size());
    s_.resize(step.spins.size());
    for_each_moving(step, [&](std::size_t i) {
        v_[i] = step.v[i];
        P_[i] = step.points[i].P;
        if (!s_.empty()) s_[i] = step.spins[i].s;
        change_[i] = -potential_energy(step, i, step.points[i].P);
        if (!credit_.empty())
            credit_[i] = step.energy[i] - 0.5 * v_[i].squaredNorm() / step.inverse_mass[i] + change_[i];
    });
}

void EnergyBound::add_potential(const Substep& step)
{
    for_each_moving(step, [&](std::size_t i) { change_[i] += potential_energy(step, i, step.points[i].P); });
}

ContactEnergy EnergyBound::change(const Substep& step) const
{
    double sum = 0, size = 0;
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
        const double mass = 1 / step.inverse_mass[i], before = v_[i].squaredNorm(), after = step.v[i].squaredNorm();
        sum += 0.5 * mass * (after - before) + change_[i];
        size += mass * (before + after) + std::abs(change_[i]);
        if (s_.empty() || !(step.spins[i].k > 0)) continue;
        const double inertia = mass / step.spins[i].k;
        sum += 0.5 * inertia * (step.spins[i].s.squaredNorm() - s_[i].squaredNorm());
        size += inertia * (step.spins[i].s.squaredNorm() + s_[i].squaredNorm());
    }
    ContactEnergy energy;
    if (std::abs(sum) > energy_rounding * size) energy.take(sum);
    return energy;
}

void EnergyBound::sum_islands(const Substep& step, EnergyIslands& islands)
{
    islands_.assign(step.size(), {});
    seen_.assign(islands.any_moves() ? step.size() : 0, {});
    for (std::uint32_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
        const std::uint32_t root = islands.root(i);
        add(step, i, islands_[root]);
        if (const EnergyIslands::Driven& by = islands.driven(root); by.moves) add_seen(step, i, by, seen_[root]);
    }
}

void EnergyBound::add(const Substep& step, std::uint32_t i, Island& island) const
{
    const Vec3d change = step.v[i] - v_[i];
    const double mass = 1 / step.inverse_mass[i];
    island.slope += mass * v_[i].dot(change);
    island.curvature += 0.5 * mass * change.squaredNorm();
    island.change += change_[i];
    island.size += mass * (v_[i].squaredNorm() + step.v[i].squaredNorm()) + std::abs(change_[i]);
    island.available += 0.5 * mass * v_[i].squaredNorm() + stored_[i] + available_work(step, i, P_[i]);
    if (!credit_.empty()) island.credit += credit_[i];
    add_turning(step, i, island);
}

// Adds the same as seen from the frame of its driver.
void EnergyBound::add_seen(const Substep& step, std::uint32_t i, const EnergyIslands::Driven& by, Island& island) const
{
    const Vec3d change = step.v[i] - v_[i], seen = v_[i] - by.mean.v, moved = step.points[i].P - P_[i];
    const double mass = 1 / step.inverse_mass[i], stored = stored_in_frame_.empty() ? stored_[i] : stored_in_frame_[i];
    const Vec3d A = by.mean.acceleration(step.dt);
    const double potential = change_[i] + stored_[i] - stored + mass * A.dot(moved);
    island.slope += mass * seen.dot(change);
    island.curvature += 0.5 * mass * change.squaredNorm();
    island.change += potential;
    island.size += mass * (v_[i].squaredNorm() + step.v[i].squaredNorm() + by.mean.v.squaredNorm()) +
                   std::abs(change_[i]) + mass * std::abs(A.dot(moved));
    island.given += 2 * mass * by.spread * (seen.norm() + by.spread);
    if (!step.mobility.empty()) {
        const Mobility& mobility = step.mobility[i];
        const SurfaceSpring& spring = step.surface_springs[i];
        double held =
            by.mean.v.norm() * (0.5 * step.dt * mobility.stiffness + 2 / step.dt * std::abs(1 - mobility.v / step.dt));
        if (spring.w2 > 0)
            held += 0.5 * step.dt * spring.w2 * (by.mean.v - velocity_of_surface(spring, P_[i], 0)).norm();
        island.given += mass * held * moved.norm();
    }
    island.available += 0.5 * mass * (seen.squaredNorm() + step.dt * step.dt * A.squaredNorm()) + stored +
                        available_work(step, i, P_[i]);
    add_turning(step, i, island);
}

void EnergyBound::add_turning(const Substep& step, std::uint32_t i, Island& island) const
{
    if (s_.empty() || !(step.spins[i].k > 0)) return;
    const Vec3d turned = step.spins[i].s - s_[i];
    const double inertia = 1 / (step.inverse_mass[i] * step.spins[i].k);
    island.slope += inertia * s_[i].dot(turned);
    island.curvature += 0.5 * inertia * turned.squaredNorm();
    island.size += inertia * (s_[i].squaredNorm() + step.spins[i].s.squaredNorm());
}

ContactEnergy EnergyBound::limit(Substep& step, EnergyIslands& islands, const RigidFallback* fallback)
{
    sum_islands(step, islands);
    ContactEnergy energy;
    driven_ = 0;
    bool limits = false, stalls = false;
    for (std::uint32_t root = 0; root < islands_.size(); ++root) {
        Island& island = islands_[root];
        const bool driven = islands.driven(root).moves;
        Island& seen = driven ? seen_[root] : island;
        const double credit = std::max(island.credit, 0.0);
        island.change -= credit;
        if (driven) seen.change -= credit + seen.given;
        if (const double gain = seen.change_at(1); gain > energy_rounding * seen.size)
            island.part = largest_part(seen.slope, seen.curvature, seen.change);
        limits |= island.part < 1;
        island.stalled = fallback && seen.change_at(1) > energy_rounding * seen.size &&
                         !(seen.change_at(island.part) <= largest_gain * seen.available);
        stalls |= island.stalled;
        const double limited = island.change_at(island.part);
        if (island.stalled || !(std::abs(limited) > energy_rounding * island.size)) continue;
        energy.take(limited);
        if (driven) driven_ += limited + credit;
    }
    for (std::size_t i = 0; i < credit_.size(); ++i)
        credit_[i] = islands_[i].stalled ? 0 : std::max(islands_[i].credit, 0.0);
    stalled_.clear();
    if (limits)
        for (std::uint32_t i = 0; i < step.size(); ++i) {
            if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
            const double part = islands_[islands.root(i)].part;
            if (!(part < 1)) continue;
            step.v[i] = v_[i] + part * (step.v[i] - v_[i]);
            if (!s_.empty()) step.spins[i].s = s_[i] + part * (step.spins[i].s - s_[i]);
        }
    if (stalls) stalled_.assign(step.size(), 0);
    return energy;
}

void EnergyBound::move_stalled(Substep& step, EnergyIslands& islands, const RigidFallback& fallback)
{
    std::map<std::uint32_t, std::vector<std::uint32_t>> points;
    for (std::uint32_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0) || !islands_[islands.root(i)].stalled) continue;
        points[islands.root(i)].push_back(i);
        stalled_[i] = 1;
    }
    for (const auto& [root, of_island] : points) {
        const EnergyIslands::Driven& by = islands.driven(root);
        fallback.apply(step, of_island, by.drivers > 0 ? &by.mean : nullptr);
        for (const std::uint32_t i : of_island)
            change_[i] = 0.5 * (step.v[i].squaredNorm() - v_[i].squaredNorm()) / step.inverse_mass[i] +
                         potential_energy(step, i, step.points[i].P) - potential_energy(step, i, P_[i]) - stored_[i];
    }
}

// The driver may have moved the held points by a jump and stretched rows, which restores that energy.
ContactEnergy EnergyBound::stalled_change(EnergyIslands& islands)
{
    std::map<std::uint32_t, double> changes;
    for (std::uint32_t i = 0; i < stalled_.size(); ++i)
        if (stalled_[i]) changes[islands.root(i)] += change_[i];
    ContactEnergy energy;
    for (const auto& [root, change] : changes) {
        energy.take(change);
        if (islands.driven(root).moves) driven_ += change;
    }
    return energy;
}

namespace {

// Returns ω for an angular momentum; its component is 0 along axes without inertia.
Vec3d rotation_rate(const Eigen::Matrix3d& inertia, const Vec3d& momentum)
{
    constexpr double least = 1e-12;  // relative to the largest
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
    Vec3d along = axes.eigenvectors().transpose() * momentum;
    for (int k = 0; k < 3; ++k) {
        const double moment = axes.eigenvalues()[k];
        along[k] = moment > least * axes.eigenvalues()[2] ? along[k] / moment : 0;
    }
    return axes.eigenvectors() * along;
}

}  // namespace

void RigidFallback::begin(const Substep& step)
{
    for (std::vector<Vec3d>* values : {&start_, &P_, &v_}) values->resize(step.size());
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            start_[i] = step.start[i], P_[i] = step.points[i].P, v_[i] = step.v[i];
    });
}

void RigidFallback::apply(Substep& step, std::span<const std::uint32_t> points, const Drive* driver) const
{
    const std::optional<Drive> rest = resting_position(step, points);
    if (driver || rest)
        carry(step, points, driver ? *driver : *rest);
    else
        move(step, points);
}

// Returns the mean motion of the surfaces that points are attached to, at rest if springs attach to positions only;
// nothing if there are no springs.
std::optional<Drive> RigidFallback::resting_position(const Substep& step, std::span<const std::uint32_t> points) const
{
    if (step.mobility.empty()) return {};
    Drive mean;
    double stiffness = 0;  // N/m
    for (const std::uint32_t i : points) {
        const double of_place = step.mobility[i].stiffness / step.inverse_mass[i];
        const SurfaceSpring& spring = step.surface_springs[i];
        const double of_surface = spring.w2 / step.inverse_mass[i];
        stiffness += of_place + of_surface;
        if (!(of_surface > 0)) continue;
        const Vec3d v_before = velocity_of_surface(spring, start_[i], step.dt);
        const Vec3d v = velocity_of_surface(spring, start_[i] + step.dt * v_before, 0);
        const Drive surface = Drive::of(v_before, v, step.dt);
        mean.v += of_surface * surface.v, mean.displacement += of_surface * surface.displacement;
    }
    if (!(stiffness > 0)) return {};
    mean.v /= stiffness, mean.displacement /= stiffness;
    return mean;
}

void RigidFallback::carry(Substep& step, std::span<const std::uint32_t> points, const Drive& driver) const
{
    for (const std::uint32_t i : points) place(step, i, start_[i] + driver.displacement, driver.v);
}

void RigidFallback::move(Substep& step, std::span<const std::uint32_t> points) const
{
    double mass = 0;
    Vec3d middle = Vec3d::Zero(), displacement = Vec3d::Zero(), velocity = Vec3d::Zero();
    for (const std::uint32_t i : points) {
        const double m = 1 / step.inverse_mass[i];
        mass += m;
        middle += m * start_[i];
        displacement += m * (P_[i] - start_[i]);
        velocity += m * v_[i];
    }
    middle /= mass, displacement /= mass, velocity /= mass;

    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Vec3d momentum = Vec3d::Zero();
    for (const std::uint32_t i : points) {
        const double m = 1 / step.inverse_mass[i];
        const Vec3d arm = start_[i] - middle;
        inertia += m * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
        momentum += m * arm.cross(v_[i] - velocity);
    }
    const Vec3d omega = rotation_rate(inertia, momentum);
    for (const std::uint32_t i : points)
        place(step, i, start_[i] + displacement, velocity + omega.cross(start_[i] - middle));
}

// Places a point as if free motion had left it there.
void RigidFallback::place(Substep& step, std::uint32_t i, const Vec3d& P, const Vec3d& v) const
{
    step.displacement[i] += step.dt * (v - step.v[i]);
    step.points[i].P = P;
    step.start[i] = start_[i];
    step.v[i] = v;
}

}  // namespace rapid

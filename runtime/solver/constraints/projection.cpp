#include "runtime/solver/constraints/projection.h"

#include <algorithm>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {
namespace {

// An impact in a cradle takes one sweep, in a gas two or three.
constexpr std::uint32_t max_impact_sweeps = 32;

// Returns true if some point moves that no row moves.
bool has_kinematic(const Substep& step)
{
    for (std::size_t i = 0; i < step.size(); ++i)
        if (!(step.inverse_mass[i] > 0) && !step.v[i].isZero(0)) return true;
    return false;
}

}  // namespace

Projection::Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles,
                       const Substep& step, Sleep* sleep, const ShapeLoads* loads, const PointErrors& errors)
    : constraints_(constraints.begin(), constraints.end()),
      sleep_(sleep),
      errors_(errors),
      has_forces_(!step.displacement.empty()),
      may_gain_(!step.mobility.empty() ||
                !std::all_of(constraints.begin(), constraints.end(),
                             [](const LocalConstraint& local) { return local.coupling->only_dissipates(); })),
      is_driven_(std::any_of(constraints.begin(), constraints.end(),
                             [](const LocalConstraint& local) { return local.coupling->is_driven(); })),
      follows_(is_driven_ || has_kinematic(step)),
      moving_support_(follows_ || std::any_of(obstacles.begin(), obstacles.end(),
                                              [](const Obstacle& obstacle) { return obstacle.moves; })),
      free_(step.size())
{
    // Rods and springs fix their reference before contacts push their points, whichever node comes first.
    std::stable_partition(constraints_.begin(), constraints_.end(),
                          [](const LocalConstraint& local) { return local.coupling->has_forces(); });
    if (!obstacles.empty() && !constraints_.empty()) shapes_.emplace(obstacles, step.size(), sizes(), sleep);
    if (shapes_ && loads && step.dt > 0) shapes_->recall(*loads, errors_.ids(), step.dt);
    for (const LocalConstraint& local : constraints_) {
        local.coupling->join(sleep);
        if (auto* holding = dynamic_cast<Holding*>(local.coupling.get())) holdings_.push_back(holding);
        if (auto* carrying = dynamic_cast<CarriedImpulses*>(local.coupling.get())) carrying_.push_back(carrying);
        local.coupling->add_joined(joined_);
    }
    std::sort(joined_.begin(), joined_.end());
    for (CarriedImpulses* carrying : carrying_) carrying->exclude(joined_);
}

// Returns the largest of the constraints' radii by point, m; empty if they have none.
std::vector<float> Projection::sizes() const
{
    std::vector<float> sizes;
    for (const LocalConstraint& local : constraints_) {
        const std::span<const float> radii = local.coupling->radii();
        if (sizes.empty()) sizes.assign(radii.begin(), radii.end());
        for (std::size_t i = 0; i < radii.size(); ++i) sizes[i] = std::max(sizes[i], radii[i]);
    }
    return sizes;
}

template <class F>
void Projection::each(const F& f)
{
    for (const LocalConstraint& local : constraints_) at_node(*local.constraint, [&] { f(*local.coupling); });
}

bool Projection::bounces() const
{
    return std::any_of(constraints_.begin(), constraints_.end(),
                       [](const LocalConstraint& local) { return local.coupling->bounces(); });
}

void Projection::advance(Substep& step)
{
    if (constraints_.empty() || !(step.dt > 0) || (sleep_ && sleep_->all())) return;
    if (sleep_) sleep_->wake_islands_now(step);
    step.is_shared = shapes_ || constraints_.size() > 1;
    if (has_forces_ || is_driven_) begin_rows(step);
    const double displacing = work_of_displacements(step), carrying = work_of_carrying(step);
    energy_.added += std::max(0.0, displacing);
    changes_.contacts += displacing + carrying;
    move_kinematic(step);
    const auto each_point = [&](const auto& f) {
        for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) f(i);
        });
    };
    const auto keep_positions = [&](std::vector<Vec3d>& P) {
        P.resize(step.size());
        each_point([&](std::size_t i) { P[i] = step.points[i].P; });
    };
    // Shapes are queried at the end of each point's own free motion, which is outside of them, plus later
    // position-only corrections, which must not add velocity.
    require_finite(step);
    if (has_forces_) {
        free_.resize(step.size());
        each_point([&](std::size_t i) { free_[i] = step.points[i].P - step.start[i]; });
        advance_linked(step, carrying);
        each_point([&](std::size_t i) { free_[i] += step.start[i]; });
        keep_positions(linked_);
    }
    for (Holding* holding : holdings_) holding->hold(step);
    begin_support(step);
    if (step.forces) step.forces->begin(step, sleep_);
    each([&](Coupling& coupling) { coupling.detect(step); });
    if (has_forces_)
        each_point([&](std::size_t i) { free_[i] += step.points[i].P - linked_[i]; });  // for woken sleepers
    else
        keep_positions(free_);
    if (shapes_) shapes_->detect(step, free_);
    bound_.begin(step, [&](double factor, std::span<double> energy) { add_stored(step, {}, factor, energy); });
    if (has_forces_ && !step.energy.empty()) {
        const std::span<double> credit = bound_.credit();
        for (std::size_t i = 0; i < credit.size(); ++i) credit[i] += stored_[i];
        add_stored(step, {}, -1, credit);
    }
    if (!step.paths.empty()) solve_impacts(step);
    const bool moved = has_forces_ || !step.paths.empty();  // by rods, springs or impacts since the free motion
    if (moved) keep_positions(linked_);
    const std::vector<Vec3d>& before = moved ? linked_ : free_;
    follow_rods(step);
    each([&](Coupling& coupling) { coupling.warm_start(step); });
    if (shapes_) shapes_->warm_start(step);
    for (int k = 0; k < step.iterations; ++k) {
        each([&](Coupling& coupling) { coupling.project(step); });
        if (shapes_) shapes_->project(step);
    }
    for (Holding* holding : holdings_) holding->settle(step);
    each_point([&](std::size_t i) { step.v[i] += (step.points[i].P - before[i]) / step.dt; });
    // Rods pass the effect of shapes on one point to others, and back.
    for (int k = has_forces_ && shapes_ ? 0 : step.iterations - 1; k < step.iterations; ++k) {
        each([&](Coupling& coupling) { coupling.solve_velocities(step); });
        if (shapes_) shapes_->solve_velocities(step);
    }
    for (Holding* holding : holdings_) holding->release(step);
    if (step.forces) {
        each([&](Coupling& coupling) { coupling.add_forces(step); });
        if (shapes_) shapes_->add_forces(step);
    }
    each([&](Coupling& coupling) { coupling.correct_penetration(step); });
    const ContactEnergy change = close_bound(step, false);
    const double credit = credited();
    energy_.added += change.added;
    energy_.lost += std::max(0.0, change.lost - credit);
    changes_.contacts += change.added - change.lost + credit;
    require_finite(step);
}

// Returns the energy, J, that reported changes exclude because drag took it before.
double Projection::credited()
{
    if (!may_gain_) return 0;
    const std::span<const double> credit = bound_.credit();
    return std::accumulate(credit.begin(), credit.end(), 0.0);
}

// Returns the work, J, of moving points out of shapes in their free motion, against rows in their earlier state.
double Projection::work_of_displacements(const Substep& step) const
{
    return has_forces_ && !step.born.empty() ? stored_change(step, step.born, step.start) : 0;
}

// Sets the initial positions of rows: points carried by shapes are at the end of their path.
void Projection::begin_rows(const Substep& step)
{
    begun_.assign(step.start.begin(), step.start.end());
    carries_ = false;
    for (std::size_t i = 0; i < begun_.size(); ++i)
        if (!(step.points[i].w > 0) && step.inverse_mass[i] > 0 && begun_[i] != step.points[i].P)
            begun_[i] = step.points[i].P, carries_ = true;
}

// Returns the increase in energy stored in rows, J, due to shapes that carry points glued to them.
double Projection::work_of_carrying(const Substep& step) const
{
    return has_forces_ && carries_ ? stored_change(step, step.start, begun_) : 0;
}

// Returns the increase in energy stored in rows, J, between two sets of positions.
double Projection::stored_change(const Substep& step, std::span<const Vec3d> from, std::span<const Vec3d> to) const
{
    std::vector<double> stored(step.size());
    add_stored(step, to, 1, stored);
    add_stored(step, from, -1, stored);
    return std::accumulate(stored.begin(), stored.end(), 0.0);
}

// Counts as energy of pins the change of the points that they move, and of the rows stretched before these act.
void Projection::move_kinematic(Substep& step)
{
    const double before = is_driven_ ? driven_energy(step) : 0;
    each([&](Coupling& coupling) { coupling.move_kinematic(step); });
    if (!is_driven_) return;
    for (std::size_t i = 0; i < begun_.size(); ++i)
        if (!(step.points[i].w > 0)) begun_[i] = step.points[i].P;
    changes_.pins += driven_energy(step) - before;
}

// Returns the energy, J, of the points and of rows at their initial positions.
double Projection::driven_energy(const Substep& step) const
{
    std::vector<double> energy(step.size());
    add_stored(step, begun_, 1, energy);
    double sum = 0;
    for (std::size_t i = 0; i < step.size(); ++i) {
        sum += energy[i];
        if (step.inverse_mass[i] > 0)
            sum += 0.5 * step.v[i].squaredNorm() / step.inverse_mass[i] + potential_energy(step, i, step.points[i].P);
    }
    return sum;
}

// Applies rods and springs. carrying: J, stored in them by shapes, which drive them if no pin does.
void Projection::advance_linked(Substep& step, double carrying)
{
    stored_.assign(step.size(), 0.0);
    add_stored(step, begun_, 1, stored_);
    bound_.begin(step, [&](double factor, std::span<double> energy) {
        for (std::size_t i = 0; i < energy.size(); ++i) energy[i] += factor * stored_[i];
    });
    if (follows_ || carries_) store_in_frame(step);
    fallback_.begin(step);
    each([&](Coupling& coupling) {
        coupling.advance(step);
        if (coupling.has_forces()) require_finite(step);
    });
    const ContactEnergy change = close_bound(step, true);
    const double driven = may_gain_ ? bound_.driven() : 0;
    energy_.added += std::max(0.0, change.added - std::max(0.0, driven));
    const bool by_shapes = carries_ && !is_driven_;
    energy_.take(by_shapes ? carrying + driven : std::max(0.0, carrying));
    (by_shapes ? changes_.contacts : changes_.pins) += driven;
    changes_.rods += change.added - change.lost + credited() - driven;
}

// Computes the energy stored in rows at first, with their points moved along with the drivers.
void Projection::store_in_frame(const Substep& step)
{
    EnergyIslands islands(step);
    link(islands, step, true);
    islands.close();
    if (!islands.any_moves()) return;
    std::vector<Vec3d> at(begun_);
    for (std::uint32_t i = 0; i < at.size(); ++i)
        if (step.points[i].w > 0)
            at[i] += islands.driven(islands.root(i)).mean.displacement;
        else
            at[i] = step.points[i].P;
    add_stored(step, at, 1, bound_.stored_in_frame());
}

double Projection::elastic_energy(const Substep& step, std::span<const Vec3d> at) const
{
    std::vector<double> stored(step.size());
    add_stored(step, at, 1, stored);
    return std::accumulate(stored.begin(), stored.end(), 0.0);
}

bool Projection::keeps_momentum() const
{
    return !shapes_ && std::all_of(constraints_.begin(), constraints_.end(),
                                   [](const LocalConstraint& local) { return local.coupling->keeps_momentum(); });
}

// Adds the energy stored in rows at these positions or, if empty, at the current ones.
void Projection::add_stored(const Substep& step, std::span<const Vec3d> at, double factor,
                            std::span<double> energy) const
{
    for (const LocalConstraint& local : constraints_) local.coupling->add_stored_energy(step, at, factor, energy);
}

// of_rods: true if only rods and springs have acted.
ContactEnergy Projection::close_bound(Substep& step, bool of_rods)
{
    const auto stored = [&](double factor, std::span<double> energy) { add_stored(step, {}, factor, energy); };
    if (!may_gain_) return bound_.measure(step, stored);
    ContactEnergy change = bound_.close(
        step, stored, [&](EnergyIslands& islands) { link(islands, step, of_rods); }, of_rods ? &fallback_ : nullptr);
    if (bound_.stalled().empty()) return change;
    const double before = energy_of_positions(step);
    each([&](Coupling& coupling) { coupling.yield(step, bound_.stalled()); });
    change.take(energy_of_positions(step) - before);
    return change;
}

void Projection::link(EnergyIslands& islands, const Substep& step, bool of_rods) const
{
    for (const LocalConstraint& local : constraints_)
        if (!of_rods || local.coupling->has_forces()) local.coupling->link(islands);
    if (shapes_ && !of_rods) shapes_->drive(islands, step);
}

// Returns the energy stored in rows plus the potential energy of points that have yielded, J.
double Projection::energy_of_positions(const Substep& step) const
{
    double sum = elastic_energy(step);
    for (std::size_t i = 0; i < step.size(); ++i)
        if (bound_.stalled()[i]) sum += potential_energy(step, i, step.points[i].P);
    return sum;
}

// Checks values as single precision stores them. Without this check, the next step would look them up in grids.
void Projection::require_finite(const Substep& step) const
{
    constexpr double surely_finite = 1e38;
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3d &P = step.points[i].P, &v = step.v[i];
            if (!(P.squaredNorm() + v.squaredNorm() < surely_finite * surely_finite))
                errors_.require_finite(i, P.cast<float>(), v.cast<float>(), PointErrors::in_substep);
        }
    });
}

// One impact leads to others. Pairs still closing after the last sweep are left to the rows, without bounce.
void Projection::solve_impacts(Substep& step)
{
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) step.paths[i].since = step.dt, step.paths[i].sweep = 0;
    });
    bool hit = true;
    std::size_t woken = sleep_ ? sleep_->woken_now() : 0;
    for (std::uint32_t sweep = 1; hit && sweep <= max_impact_sweeps; ++sweep) {
        hit = false;
        each([&](Coupling& coupling) { hit |= coupling.solve_impacts(step, sweep); });
        if (!shapes_) continue;
        // Sleepers woken by impacts get contacts with shapes.
        if (sleep_ && woken != sleep_->woken_now()) {
            woken = sleep_->woken_now();
            shapes_->detect(step, free_);
        }
        if (hit) shapes_->solve_impacts(step, sweep);
    }
}

// Points that no constraint moves support others, like shapes.
void Projection::begin_support(Substep& step)
{
    support_.resize(step.size());
    next_support_.resize(step.size());
    std::swap(support_, next_support_);
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0)) support_[i] = 255;
        next_support_[i] = 0;
    }
    step.support = support_;
    step.next_support = next_support_;
    if (!moving_support_) return;
    support_v_.resize(step.size());
    next_support_v_.resize(step.size());
    std::swap(support_v_, next_support_v_);
    for (std::size_t i = 0; i < step.size(); ++i)
        if (!(step.points[i].w > 0)) support_v_[i] = step.v[i];
    step.support_v = support_v_;
    step.next_support_v = next_support_v_;
}

void Projection::follow_rods(const Substep& step)
{
    if (carrying_.empty()) return;
    rods_.clear();
    if (has_forces_) {
        EnergyIslands islands(step);
        link(islands, step, true);
        rods_.resize(step.size());
        for (std::uint32_t i = 0; i < rods_.size(); ++i) rods_[i] = islands.root(i);
    }
    for (CarriedImpulses* carrying : carrying_) carrying->follow_rods(rods_);
}

void Projection::close(Substep& step, ShapeLoads* loads, FrameFigures& figures)
{
    if (!(step.dt > 0)) return;
    each([&](Coupling& coupling) { coupling.close(step, figures); });
    if (shapes_ && loads) shapes_->remember(*loads, errors_.ids(), step);
}

}  // namespace rapid

#include "runtime/solver/coupled_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/base/memory_budget.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

// Checks memory before anything is allocated. Constraints check their additional memory themselves.
std::size_t with_room(std::size_t points)
{
    constexpr double bytes_per_point = 200;  // of the step, and of a search for neighbours: 150 to 275 were measured
    const double bytes = bytes_per_point * static_cast<double>(points);
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("a step of {} points that act on one another", points), bytes,
                              "use fewer points");
    return points;
}

}  // namespace

CoupledStep::CoupledStep(StepContext& context, const Dynamics& dynamics)
    : context_(context),
      dynamics_(dynamics),
      at_(with_room(context.points.size())),
      v_(context.points.size()),
      start_(context.points.size()),
      inverse_mass_(context.points.size())
{
}

void CoupledStep::run()
{
    const SolveOptions& options = context_.options;
    const StepScene& scene = context_.scene;
    context_.for_each_chunk([&](std::size_t begin, std::size_t end) { read_points(begin, end); });
    begin_substeps();
    begin_held();
    begin_forces();
    begin_spins();
    if (options.sleep_records && std::isfinite(options.sleep) && context_.points.has("still")) {
        sleep_.emplace(context_.points, inverse_mass_, options.sleep);
        skips_sleepers_ = scene.is_ballistic() && scene.uniform.linear.is_zero();
    }
    Projection projection(scene.constraints, scene.obstacles, now_, sleep_ ? &*sleep_ : nullptr, options.loads,
                          context_.errors);
    if (sleep_) sleep_->open(*options.sleep_records);
    for (std::size_t i = 0; sleep_ && i < now_.spins.size(); ++i)
        if (!now_.spins[i].s.isZero(0)) sleep_->wake(i);
    const LedgerState before = LedgerState::of(now_, projection.elastic_energy(now_));
    if (projection.bounces()) {
        paths_.resize(at_.size());
        now_.paths = paths_;
    }

    for (int substep = 0; substep < options.substeps; ++substep) {
        now_.index = substep;
        now_.time = options.time - now_.dt * (options.substeps - substep - 1);
        now_.max_acceleration = 0;
        if (options.interacts) interact(substep == 0 ? 1 : 2, now_.time - now_.dt);
        if (sleep_) sleep_->begin(now_, scene.obstacles);
        context_.for_each_chunk([&](std::size_t begin, std::size_t end) { advance_freely(begin, end); });
        if (spin_) spin_->begin();
        projection.advance(now_);
        if (spin_) spin_->turn(context_.time, options.substeps);
    }
    if (options.interacts) interact(1, options.time);

    FrameFigures& figures = context_.figures();
    if (sleep_) sleep_->clear_loads();
    projection.close(now_, options.loads, figures);
    figures.contact_energy += projection.energy();
    if (!scene.constraints.empty())
        figures.ledger = ledger_of(before, LedgerState::of(now_, projection.elastic_energy(now_)), changes(projection),
                                   is_isolated(projection), now_.acceleration, options.h);
    if (sleep_) sleep_->close(now_, context_.P, context_.v, context_.time);
    context_.for_each_chunk([&](std::size_t begin, std::size_t end) { store(begin, end); });
    if (!displaced_.empty()) add_displacements(projection);
    if (forces_) forces_->store(context_.points);
    if (spin_) spin_->store(context_.points);
    if (!sleep_) return;
    sleep_->remember(*options.sleep_records, now_, scene.obstacles);
    figures.asleep = options.sleep_records->records.size();
}

// Returns true if the points are subject only to a common acceleration and to each other.
bool CoupledStep::is_isolated(const Projection& projection) const
{
    const StepScene& scene = context_.scene;
    return projection.keeps_momentum() && scene.is_ballistic() && scene.uniform.linear.is_zero() &&
           scene.actions.empty() && !context_.options.interacts && !(sleep_ && sleep_->any()) &&
           !context_.time.own.data && now_.dt > 0 &&
           std::all_of(inverse_mass_.begin(), inverse_mass_.end(), [](double w) { return w > 0; });
}

void CoupledStep::read_points(std::size_t begin, std::size_t end)
{
    for (std::size_t i = begin; i < end; ++i) {
        inverse_mass_[i] = at_[i].w = inverse_mass(i);
        at_[i].P = context_.P[i].cast<double>();
        v_[i] = context_.v[i].cast<double>();
    }
}

void CoupledStep::begin_substeps()
{
    const StepScene& scene = context_.scene;
    now_.points = at_;
    now_.v = v_;
    now_.start = start_;
    now_.inverse_mass = inverse_mass_;
    now_.dead = context_.dead;
    now_.log = context_.options.sinks.log;
    now_.dt = context_.options.h / context_.options.substeps;
    now_.iterations = context_.options.iterations;
    now_.acceleration = scene.uniform.a;
    if (!scene.uniform.a.isZero(0)) now_.up = -scene.uniform.a.normalized();
    const bool has_forces = std::any_of(scene.constraints.begin(), scene.constraints.end(),
                                        [](const LocalConstraint& local) { return local.coupling->has_forces(); });
    if (has_forces) displacement_.resize(at_.size());
    now_.displacement = displacement_;
    if (has_forces && !scene.obstacles.empty()) born_.resize(at_.size());
    now_.born = born_;
    if (!scene.forces.empty() || !scene.uniform.linear.is_zero()) {
        mobility_.assign(at_.size(), {now_.dt, 0.5 * now_.dt * now_.dt});
        now_.mobility = mobility_;
        surface_springs_.resize(at_.size());
        now_.surface_springs = surface_springs_;
        energy_.resize(at_.size());
        now_.energy = energy_;
    }
}

void CoupledStep::begin_held()
{
    held_.assign(at_.size(), 0);
    for (const LocalConstraint& local : context_.scene.constraints) local.coupling->prescribe(held_);
    prescribed_ = held_;
    carried_.assign(at_.size(), 0);
    if (!context_.scene.obstacles.empty()) carried_v_.assign(at_.size(), Vec3d::Zero());
    now_.carried_v = carried_v_;
}

void CoupledStep::begin_forces()
{
    for (const LocalConstraint& local : context_.scene.constraints) {
        const std::span<const float> radii = local.coupling->recorded();
        if (radii.empty()) continue;
        if (!forces_) forces_.emplace(at_.size());
        forces_->include(radii);
    }
    if (forces_) now_.forces = &*forces_;
}

void CoupledStep::begin_spins()
{
    const std::vector<Obstacle>& obstacles = context_.scene.obstacles;
    for (const LocalConstraint& local : context_.scene.constraints) {
        const ContactMaterial* material = local.coupling->turns();
        if (!material) continue;
        if (!spin_) spin_.emplace();
        at_node(*local.constraint, [&] { spin_->include(context_.points, *material); });
    }
    if ((forces_ || spin_) && !obstacles.empty()) reaction_.resize(at_.size());
    now_.reaction = reaction_;
    if (!spin_) return;
    now_.spins = spin_->spins();
    smooth_ = obstacles;
    for (Obstacle& obstacle : smooth_) {
        std::vector<float>& friction = smooth_friction_.emplace_back(at_.size());
        for (std::size_t i = 0; i < friction.size(); ++i) friction[i] = now_.spins[i].k > 0 ? 0 : obstacle.friction[i];
        obstacle.friction = {friction.data(), 1};
    }
}

// Applies kicks of half a substep, which wake sleepers.
void CoupledStep::interact(int kicks, double time)
{
    std::vector<Vec3d> P(at_.size());
    for (std::size_t i = 0; i < P.size(); ++i) P[i] = at_[i].P;
    rapid::interact(context_.points, dynamics_, context_.options,
                    {P, v_, context_.dead, time, context_.options.substeps}, kicks);
    for (std::size_t i = 0; sleep_ && i < v_.size(); ++i)
        if (sleep_->asleep(i) && !v_[i].isZero(0)) sleep_->wake(i);
}

// Computes the free motion of a chunk in one substep.
void CoupledStep::advance_freely(std::size_t begin, std::size_t end)
{
    const StepScene& scene = context_.scene;
    CollisionContext context = context_.collision_context();
    context.held = held_.data();
    Collisions collisions(spin_ ? smooth_ : scene.obstacles, context);
    BlockStep step(context_);
    const PointBlock& block = step.block;
    std::vector<std::uint32_t> indices;
    double max_acceleration = 0;
    EnergyChanges changes;
    for (std::size_t first = begin; first < end; first += block_size) {
        const std::size_t last = std::min(first + block_size, end);
        indices.clear();
        for (std::size_t i = first; i < last; ++i) {
            start_[i] = at_[i].P;
            if (!born_.empty()) born_[i] = at_[i].P;
            if (!reaction_.empty()) reaction_[i].setZero();
            if (!skips_sleepers_ || !skips(i)) indices.push_back(static_cast<std::uint32_t>(i));
        }
        if (indices.empty()) {
            max_acceleration = std::max(max_acceleration, scene.uniform.a.norm());
            continue;
        }
        begin_block(step, indices);
        if (!scene.obstacles.empty()) collisions.begin(block.indices);
        step.advance(collisions, now_.index);
        // A point that was moved out of a shape gets no velocity from that towards points it now overlaps, as if it
        // had been born there.
        for (const auto& [k, by] : collisions.displacements())
            if (!held_[block.indices[k]]) start_[block.indices[k]] += by;
        for (std::size_t k = 0; k < block.size(); ++k) {
            if (!surface_springs_.empty()) surface_springs_[block.indices[k]] = step.surface_spring(k);
            if (block.linear.data && !held_[block.indices[k]]) add_drag(block, k, collisions.contact_work(k), changes);
            take_point(block, k, !scene.obstacles.empty() && collisions.is_carried(k));
        }
        for (std::size_t k = 0; k < (block.a.stride ? block.size() : 1); ++k)
            max_acceleration = std::max(max_acceleration, block.a[k].norm());
    }
    const FrameFigures& figures = collisions.figures();
    context_.count(figures, begin);
    changes.contacts += figures.contact_energy.added - figures.contact_energy.lost;
    const std::scoped_lock lock(mutex_);
    free_changes_.emplace_back(begin, changes);
    now_.max_acceleration = std::max(now_.max_acceleration, max_acceleration);
}

void CoupledStep::begin_block(BlockStep& step, std::span<const std::uint32_t> indices)
{
    PointBlock& block = step.block;
    step.begin(indices, context_.options.substeps);
    if (!reaction_.empty()) block.reaction.assign(indices.size(), Vec3d::Zero());
    for (std::size_t k = 0; k < block.size(); ++k) {
        const std::uint32_t i = indices[k];
        block.P[k] = at_[i].P;
        block.v[k] = v_[i];
        const bool asleep = sleep_ && sleep_->asleep(i);
        if (asleep) block.moved_dt[k] = 0;
        held_[i] = asleep || prescribed_[i];
    }
}

// Stores the end of a point's free motion, at which the projection starts. is_carried: a shape prescribes it.
void CoupledStep::take_point(const PointBlock& block, std::size_t k, bool is_carried)
{
    const std::uint32_t i = block.indices[k];
    carried_[i] = is_carried && !held_[i];
    if (!carried_v_.empty()) carried_v_[i] = carried_[i] ? v_[i] : Vec3d(Vec3d::Zero());
    ProjectedPoint& at = at_[i];
    at.w = inverse_mass_[i];
    if (!paths_.empty()) paths_[i] = free_path(block, k);
    if (!mobility_.empty() && inverse_mass_[i] > 0) {
        mobility_[i] = mobility_of(block, k);
        // A moving shape's work through a spring is not energy that drag has taken.
        const bool is_driven = surface_springs_[i].w2 > 0 && surface_springs_[i].shape->moves();
        const Vec3d &P = is_driven ? block.P[k] : start_[i], &v = is_driven ? block.v[k] : v_[i];
        energy_[i] = 0.5 * v.squaredNorm() / inverse_mass_[i] + potential_energy(now_, i, P);
    }
    if (sleep_ && !skips_sleepers_) sleep_->check_acceleration(i, acceleration_of(block, k, sleep_->asleep(i)));
    if (held_[i]) {
        at.w = 0;
        return;
    }
    if (!(at.w > 0)) {  // moved only by its own velocity
        if (context_.advances(i)) at.P += block.dt[k] * v_[i];
        return;
    }
    at.P = block.P[k];
    v_[i] = block.v[k];
    if (carried_[i]) {
        at.w = 0;
        return;
    }
    if (!reaction_.empty()) reaction_[i] = block.reaction[k];
    if (!displacement_.empty())
        displacement_[i] =
            block.linear.data ? Vec3d(at.P - start_[i]) : Vec3d(block.dt[k] * (v_[i] - 0.5 * block.dt[k] * block.a[k]));
    if (!block.linear.data) return;
    // v_of_G may have any sign for a spring that swings through in the substep.
    at.w *= std::max(mobility_[i].v, mobility_[i].x / now_.dt) / now_.dt;
}

Mobility CoupledStep::mobility_of(const PointBlock& block, std::size_t k) const
{
    if (!block.linear.data) return {now_.dt, 0.5 * now_.dt * now_.dt, block.a[k]};
    const Propagator by = respond(block.damped[k].k, block.damped[k].w2, now_.dt);
    return {by.v_of_G, by.x_of_G, block.a[k] + block.linear[k].w2q, block.linear[k].w2};
}

// Adds the energy that drag takes in the free motion: the remainder after the own acceleration, springs and contacts
// (J/kg).
void CoupledStep::add_drag(const PointBlock& block, std::size_t k, double contacts, EnergyChanges& changes) const
{
    const std::uint32_t i = block.indices[k];
    const Linear& linear = block.linear[k];
    const SurfaceSpring& surface = surface_springs_[i];
    if (!(inverse_mass_[i] > 0) || !(block.dt[k] > 0) || (linear.k == 0 && linear.c == 0)) return;
    if (surface.w2 > 0 && surface.shape->moves()) return;  // the work of the shape is not known separately
    const Vec3d &from = start_[i], &to = block.P[k], displacement = to - from;
    const double kinetic = 0.5 * (block.v[k] - v_[i]).dot(block.v[k] + v_[i]);
    double springs = (0.5 * linear.w2 * (to + from) - linear.w2q).dot(displacement);
    if (surface.w2 > 0) springs += potential_energy(surface, to) - potential_energy(surface, from);
    changes.drag += (kinetic - block.a[k].dot(displacement) + springs - contacts) / inverse_mass_[i];
}

EnergyChanges CoupledStep::changes(const Projection& projection)
{
    // In the order of the points, because a sum of doubles depends on it.
    std::stable_sort(free_changes_.begin(), free_changes_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    EnergyChanges all = projection.changes();
    for (const auto& [first, changes] : free_changes_) all += changes;
    if (!forces_ || spin_) return all;
    all.split = {forces_->friction_work(), forces_->shape_work()};
    all.contacts -= all.split->friction + all.split->shapes;
    return all;
}

// Returns true if a sleeper under uniform forces stays asleep and can be skipped in the blocks.
bool CoupledStep::skips(std::size_t i)
{
    sleep_->check_acceleration(i, context_.scene.uniform.a);
    if (!sleep_->asleep(i)) return false;
    at_[i].w = 0;
    if (!paths_.empty()) paths_[i] = {context_.scene.uniform.a, Vec3d::Zero()};
    return true;
}

// Returns a point's acceleration towards the end of its free motion. A shape that supports it, with at most the
// acceleration of forces, is assumed to have done so throughout; a larger velocity change was a contact.
FreePath CoupledStep::free_path(const PointBlock& block, std::size_t k) const
{
    const std::uint32_t i = block.indices[k];
    const Vec3d a = acceleration_of(block, k, false);
    const double dt = block.moved_dt[k];
    if (context_.scene.obstacles.empty() || !context_.scene.actions.empty() || !(dt > 0)) return {a, Vec3d::Zero()};
    const Vec3d free = block.linear.data ? block.damped[k].v : Vec3d(v_[i] + dt * a);
    const Vec3d reaction = (block.v[k] - free) / dt;
    if (!(reaction.squaredNorm() <= 1.001 * a.squaredNorm())) return {a, Vec3d::Zero()};
    return {a + reaction, reaction};
}

// Returns the acceleration of a point in a substep, m/s²; for a sleeper, it includes motion and velocity from actions.
Vec3d CoupledStep::acceleration_of(const PointBlock& block, std::size_t k, bool asleep) const
{
    const Vec3d& from = start_[block.indices[k]];
    Vec3d a = block.a[k];
    if (block.linear.data) {
        const Linear& linear = block.linear[k];
        a += linear.ku + linear.w2q - linear.w2 * from;
    }
    const double dt = block.dt[k];
    if (asleep && dt > 0) a += block.v[k] / dt + (block.P[k] - from) / (dt * dt);
    return a;
}

// Rounds to single precision. A drift of zero duration finds the surface that a point lies on, so that it can be
// rounded to its outer side.
void CoupledStep::store(std::size_t begin, std::size_t end)
{
    const bool collides = !context_.scene.obstacles.empty();
    CollisionContext context = context_.collision_context();
    context.log = nullptr;  // contacts found here do not belong to the step
    Collisions collisions(context_.scene.obstacles, context);
    BlockStep step(context_);
    PointBlock& block = step.block;
    std::vector<std::uint32_t> indices;
    double deepest = 0;
    for (std::size_t first = begin; first < end; first += block_size) {
        const std::size_t size = std::min(block_size, end - first);
        indices.resize(size);
        std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(first));
        step.begin(indices, context_.options.substeps);
        for (std::size_t i = 0; i < size; ++i) {
            block.P[i] = at_[first + i].P;
            block.v[i] = v_[first + i];
        }
        if (collides) {
            block.dt.assign(size, 0);
            collisions.begin(block.indices);
            collisions.advance(block.P, block.v, {{&context_.scene.uniform.a, 0}, block.dt, block.dt, {}});
            std::vector<std::size_t> displaced;  // out of shapes, or back to the position at which they stick
            for (std::size_t i = 0; i < size; ++i)
                if (block.P[i] != at_[first + i].P) displaced.push_back(i);
            deepest = std::max(deepest, collisions.round(block.P, block.rounded));
            for (const Ejection::Displacement& one : collisions.corrections()) displaced.push_back(one.i);
            for (const std::size_t i : displaced) {
                const std::scoped_lock lock(mutex_);
                if (!holds_still(first + i)) displaced_[first + i] = block.P[i];
            }
            // Contacts found here do not count, because the constraints have treated them.
            for (std::size_t i = 0; i < size; ++i) {
                block.v[i] = v_[first + i];
                if (holds_still(first + i)) block.rounded[i] = at_[first + i].P.cast<float>();
            }
        } else {
            cast(std::span<const Vec3d>(block.P), block.rounded);
        }
        step.require_finite();
        step.store();
    }
    FrameFigures figures;
    figures.penetration_max = deepest;
    context_.count(figures, begin);
}

// Adds the work against forces and rows of moving points out of shapes that constraints pushed them into, and back to
// the positions at which they stick.
void CoupledStep::add_displacements(const Projection& projection)
{
    std::vector<Vec3d> P(at_.size());
    for (std::size_t i = 0; i < P.size(); ++i) P[i] = at_[i].P;
    double by_forces = 0, by_acceleration = 0;
    for (const auto& [i, position] : displaced_) {
        P[i] = position;
        if (!(inverse_mass_[i] > 0)) continue;
        by_forces += potential_energy(now_, i, position) - potential_energy(now_, i, at_[i].P);
        by_acceleration -= now_.acceleration.dot(position - at_[i].P) / inverse_mass_[i];
    }
    const double elastic = projection.elastic_energy(now_, P) - projection.elastic_energy(now_);
    FrameFigures& figures = context_.figures();
    figures.contact_energy.take(by_forces + elastic);
    if (!figures.ledger) return;
    figures.ledger->potential += by_acceleration;
    figures.ledger->elastic += elastic;
    figures.ledger->by.contacts += by_forces + elastic;
    figures.ledger->by_motion += by_acceleration - by_forces;
}

// Returns true if a constraint prescribes the position or the point has slept, so that no shape may move it.
bool CoupledStep::holds_still(std::size_t i) const { return !(at_[i].w > 0) && inverse_mass_[i] > 0 && !carried_[i]; }

double CoupledStep::inverse_mass(std::size_t i) const
{
    return context_.advances(i) ? context_.errors.inverse_mass(i, context_.scene.mass[i]) : 0;
}

}  // namespace rapid

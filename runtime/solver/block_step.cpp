#include "runtime/solver/block_step.h"

#include <algorithm>
#include <bit>

#include "runtime/base/cancellation.h"
#include "runtime/solver/changing.h"

namespace rapid {
namespace {

// Adds the values if all of them are finite; shapes [n].
bool add_finite(std::span<const Vec3d> values, std::span<Vec3d> to)
{
    const double* x = coordinates(values);
    double* y = coordinates(to);
    std::uint64_t largest = 0;
    for (std::size_t l = 0; l < 3 * values.size(); ++l)
        largest = std::max(largest, std::bit_cast<std::uint64_t>(x[l]) & 0x7fffffffffffffffu);
    if (largest >= 0x7ff0000000000000u) return false;
    for (std::size_t l = 0; l < 3 * values.size(); ++l) y[l] += x[l];
    return true;
}

}  // namespace

void BlockStep::advance(Collisions& collisions, int substep)
{
    Cancellation::check_current();
    add_forces(substep);
    if (context_.scene.kills) stop_dead();
    const double halves_after = 2.0 * (block.substeps - substep - 1);
    if (context_.scene.actions.empty()) {
        drift(collisions, block.moved_dt, halves_after);
        return;
    }
    half_.resize(block.size());
    for (std::size_t i = 0; i < block.size(); ++i) half_[i] = 0.5 * block.moved_dt[i];
    drift(collisions, half_, halves_after + 1);
    act(substep);
    drift(collisions, half_, halves_after);
}

// The acceleration is constant within the substep. Varying forces are evaluated at its middle, after half a drift,
// which makes them second order.
void BlockStep::add_forces(int substep)
{
    const StepScene& scene = context_.scene;
    block.a = {&scene.uniform.a, 0};
    block.linear = {scene.uniform.linear.is_zero() ? nullptr : &scene.uniform.linear, 0};
    if (scene.is_uniform() || add_uniform_forces(substep)) return;
    const std::size_t size = block.size();
    block.own_a.assign(size, scene.uniform.a);
    block.a = {block.own_a.data(), 1};
    if (scene.force) add_force_attribute();
    if (scene.forces.empty()) return;

    surface_springs_.begin(size);
    middle_.resize(size);
    for (std::size_t i = 0; i < size; ++i) middle_[i] = block.P[i] + 0.5 * block.dt[i] * block.v[i];
    set_time(substep);
    const Chunk chunk{context_.points, block.indices.front(), middle_, block.v, block.dt, time_, substep};
    for (const StepForce& local : scene.forces) {
        one_.reset(size);
        if (local.uniform)
            one_.add(*local.uniform);
        else
            at_node(*local.force, [&] { local.force->contribute(chunk, one_); });
        const bool plain = local.all && !one_.is_uniform() && one_.uniform().isZero(0);
        if (!plain || !add_finite(one_.accelerations(), block.own_a)) add_accelerations(local);
        if (one_.has_linear()) add_linear(local);
        if (one_.has_surface_springs()) add_surface_springs(local);
    }
}

// Adds forces that change within the frame but not between points, evaluated once at half the time. Returns false if
// there is another kind of force.
bool BlockStep::add_uniform_forces(int substep)
{
    const StepScene& scene = context_.scene;
    if (scene.force || context_.time.own.data) return false;
    const double dt = context_.options.h / block.substeps;
    const double time = context_.options.time - dt * (block.substeps - substep - 0.5);
    uniform_ = scene.uniform;
    for (const StepForce& local : scene.forces) {
        std::optional<Uniform> uniform = local.uniform;
        if (const auto* timed = dynamic_cast<const TimedForce*>(local.force)) uniform = timed->uniform_at(time);
        if (!local.all || !uniform || !uniform->a.allFinite()) return false;
        uniform_.a += uniform->a;
        uniform_.linear.add(uniform->linear);
    }
    block.a = {&uniform_.a, 0};
    block.linear = {uniform_.linear.is_zero() ? nullptr : &uniform_.linear, 0};
    return true;
}

void BlockStep::add_force_attribute()
{
    const Column<Vec3f>& force = *context_.scene.force;
    for (std::size_t i = 0; i < block.size(); ++i)
        block.own_a[i] += acceleration_by(force[block.indices[i]].cast<double>(), block.indices[i]);
}

void BlockStep::add_accelerations(const StepForce& local)
{
    for (std::size_t i = 0; i < block.size(); ++i) {
        if (!local.all && !local.members[block.indices[i]]) continue;
        const Vec3d a = one_.acceleration(i);
        if (!a.allFinite()) at_node(*local.force, [&] { context_.errors.bad_acceleration(block.indices[i], a); });
        block.own_a[i] += a;
    }
}

void BlockStep::add_linear(const StepForce& local)
{
    own_linear();
    for (std::size_t i = 0; i < block.size(); ++i)
        if (local.all || local.members[block.indices[i]]) block.own_linear[i].add(one_.linear(i));
}

void BlockStep::add_surface_springs(const StepForce& local)
{
    own_linear();
    for (std::size_t i = 0; i < block.size(); ++i)
        if (local.all || local.members[block.indices[i]])
            surface_springs_.add(i, one_.surface_spring(i), block.P[i], block.dt[i], block.own_linear[i]);
}

// Gives each point an individual linear part.
void BlockStep::own_linear()
{
    if (block.linear.stride != 0) return;
    block.own_linear.assign(block.size(), context_.scene.uniform.linear);
    block.linear = {block.own_linear.data(), 1};
}

void BlockStep::drift(Collisions& collisions, std::span<const double> dt, double halves_after)
{
    if (!surface_springs_.empty()) surface_springs_.advance(block, dt);
    if (!context_.scene.obstacles.empty() || !context_.scene.constraints.empty() || context_.options.interacts)
        return drift_among_others(collisions, dt, halves_after);
    if (block.linear.data)
        block.drift_damped(dt);
    else
        block.drift(dt);
    if (!surface_springs_.empty()) surface_springs_.move(block);
}

// halves_after: half substeps from the end of the drift to the end of the frame.
void BlockStep::drift_among_others(Collisions& collisions, std::span<const double> dt, double halves_after)
{
    block.damped.clear();
    if (block.linear.data) block.find_damped_paths(dt);
    if (!surface_springs_.empty()) surface_springs_.bend(block.damped);
    if (!context_.scene.obstacles.empty()) {
        after_.resize(block.size());
        for (std::size_t i = 0; i < block.size(); ++i) after_[i] = 0.5 * halves_after * block.dt[i];
        if (!block.reaction.empty()) find_free_velocities(dt);
        collisions.advance(block.P, block.v, {block.a, dt, after_, block.damped});
        if (!block.reaction.empty()) add_reactions();
    } else if (block.linear.data) {
        for (std::size_t i = 0; i < block.size(); ++i) {
            block.P[i] += block.damped[i].travel;
            block.v[i] = block.damped[i].v;
        }
    } else {
        block.drift(dt);
    }
}

// Finds the velocities at the ends of paths without shapes.
void BlockStep::find_free_velocities(std::span<const double> dt)
{
    free_.resize(block.size());
    for (std::size_t i = 0; i < block.size(); ++i)
        free_[i] = block.linear.data ? block.damped[i].v : Vec3d(block.v[i] + dt[i] * block.a[i]);
}

void BlockStep::add_reactions()
{
    constexpr double rounding = 1e-12;
    for (std::size_t i = 0; i < block.size(); ++i) {
        const Vec3d by = block.v[i] - free_[i];
        if (by.norm() > rounding * free_[i].norm()) block.reaction[i] += by;
    }
}

// Applies all actions in the order of the chain, with points in the middle of the substep. The forces that they add
// are kicks over the whole substep. Dead points do not move any more.
void BlockStep::act(int substep)
{
    const std::size_t size = block.size();
    set_time(substep);
    kick_.assign(size, Vec3d::Zero());
    const std::span<std::uint8_t> dead(context_.dead.data() + block.indices.front(), size);
    if (context_.options.sinks.log) dead_before_.assign(dead.begin(), dead.end());
    const Chunk chunk{context_.points, block.indices.front(), block.P, block.v, block.dt, time_, substep};
    for (const StepAction& local : context_.scene.actions)
        at_node(*local.action, [&] { local.pass->act(chunk, kick_, dead); });
    for (std::size_t i = 0; i < size; ++i) {
        block.v[i] += block.dt[i] * acceleration_by(kick_[i], block.indices[i]);
        if (!dead[i]) continue;
        if (context_.options.sinks.log && !dead_before_[i])
            context_.options.sinks.log->kill(block.indices[i], time_[i]);
        block.dt[i] = block.moved_dt[i] = half_[i] = 0;
    }
}

// Points that a collider has killed stay in place.
void BlockStep::stop_dead()
{
    for (std::size_t i = 0; i < block.size(); ++i)
        if (context_.dead[block.indices[i]]) block.dt[i] = block.moved_dt[i] = 0;
}

void BlockStep::require_finite() const
{
    for (std::size_t i = 0; i < block.size(); ++i)
        context_.errors.require_finite(block.indices[i], block.rounded[i], block.v[i].cast<float>(),
                                       PointErrors::in_step);
}

void BlockStep::store() const
{
    for (std::size_t i = 0; i < block.size(); ++i) {
        context_.P[block.indices[i]] = block.rounded[i];
        context_.v[block.indices[i]] = block.v[i].cast<float>();
    }
}

// Sets the middle of each point's substep, s since the start.
void BlockStep::set_time(int substep)
{
    time_.resize(block.size());
    for (std::size_t i = 0; i < block.size(); ++i)
        time_[i] = context_.options.time - block.dt[i] * (block.substeps - substep - 0.5);
}

}  // namespace rapid

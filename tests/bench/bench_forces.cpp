// The cost of forces on one thread: gravity, drag and wind together, the same with rates per point, and turbulence, at
// one substep per frame and at sixteen. `each` is the time per point and substep. Also measures the cost of the
// position error estimate.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <ctime>
#include <random>

#include "runtime/graph/arguments.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/solve.h"

namespace rapid {
namespace {

using Arguments = std::map<std::string, Value>;

// Returns the force that the node adds to the points that pass through it.
Dynamics force(const std::string& type, Arguments arguments)
{
    static const Registry registry;
    const Node node{&registry.at(type), type + "1", {}, 0, {}, std::move(arguments)};
    const auto op = node.type->make();
    const auto simulation = std::make_shared<Simulation>();
    FrameFigures figures;
    std::vector<std::string> warnings;
    const std::function<void(const std::string&, const PointSet&)> no_write;
    bind_arguments(node, *op, simulation->clock(), simulation->frame(2), false);
    const Evaluation now{simulation->frame(2),    false,   node.name, node.location,
                         RandomKey(0, node.name), figures, warnings,  no_write};
    Flow input{PointSet(), {}, simulation};
    return op->evaluate({&input, 1}, now).dynamics;
}

Dynamics air(Value linear, double quadratic)
{
    Dynamics forces = force("gravity", {});
    forces.merge(force("drag", {{"linear", std::move(linear)}, {"quadratic", quadratic}}));
    forces.merge(force("wind", {{"velocity", Vec3d(3, 0, 1)}, {"drag", 0.5}}));
    return forces;
}

Dynamics turbulence(double speed)
{
    return force("turbulence", {{"amplitude", 5.0}, {"octaves", 3.0}, {"speed", speed}});
}

// Points throughout a cube, each with its own rate.
PointSet crowd(std::size_t count)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<float> in(-1, 1);
    PointSet set;
    set.append(count);
    std::int64_t next = 0;
    for (std::int64_t& id : set.id().write()) id = next++;
    for (Vec3f& P : set.P().write()) P = 10 * Vec3f(in(random), in(random), in(random));
    for (Vec3f& v : set.v().write()) v = Vec3f(in(random), in(random), in(random));
    set.add({"rate", 0.0f});
    for (float& rate : set.column<float>("rate").write()) rate = 1 + in(random);
    return set;
}

void frames(benchmark::State& state, const Dynamics& forces)
{
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    constexpr std::size_t count = 250'000;
    PointSet set = crowd(count);
    SolveOptions options;
    options.h = 1.0 / 24;
    options.substeps = static_cast<int>(state.range(0));
    for (auto _ : state) {
        options.time += options.h;
        solve(set, forces, options);
    }
    const auto steps = static_cast<double>(state.iterations() * state.range(0)) * count;
    state.counters["each"] = benchmark::Counter(steps, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// The cost of the error estimate: the shadows' share of the time of Solve, in percent.
void error_estimate(benchmark::State& state, const Dynamics& forces)
{
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    PointSet set = crowd(static_cast<std::size_t>(state.range(0)));
    SolveOptions options, finer;
    options.h = finer.h = 1.0 / 24;
    finer.substeps = 2;
    Shadows shadows;
    std::clock_t telling = 0, all = 0;
    const auto frame = [&] {
        options.time = finer.time += options.h;
        const std::clock_t begin = std::clock();
        shadows.begin(set, is_closed_form(set, forces, options));
        const std::clock_t begun = std::clock();
        solve(set, forces, options);
        const std::clock_t solved = std::clock();
        shadows.advance(set, [&](PointSet& points) { solve(points, forces, finer); });
        const std::clock_t end = std::clock();
        telling += begun - begin + end - solved;
        all += end - begin;
    };
    frame();  // all points are born and estimated for the first time
    telling = all = 0;
    for (auto _ : state) frame();
    state.counters["percent"] = 100.0 * static_cast<double>(telling) / static_cast<double>(all);
}
void error_in_turbulence(benchmark::State& state) { error_estimate(state, turbulence(0)); }

void gravity_alone(benchmark::State& state) { frames(state, force("gravity", {})); }
void air_alike(benchmark::State& state) { frames(state, air(2.0, 0)); }
void air_by_attribute(benchmark::State& state) { frames(state, air(AttributeRef{"rate"}, 0)); }
void air_with_quadratic_drag(benchmark::State& state) { frames(state, air(2.0, 0.1)); }
void still_turbulence(benchmark::State& state) { frames(state, turbulence(0)); }
void moving_turbulence(benchmark::State& state) { frames(state, turbulence(1)); }
void turbulence_in_air(benchmark::State& state)
{
    Dynamics forces = air(2.0, 0);
    forces.merge(turbulence(0));
    frames(state, forces);
}

#define WITH_1_AND_16_SUBSTEPS Arg(1)->Arg(16)->ArgName("substeps")->Unit(benchmark::kMillisecond)
BENCHMARK(gravity_alone)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(air_alike)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(air_by_attribute)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(air_with_quadratic_drag)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(still_turbulence)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(moving_turbulence)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(turbulence_in_air)->WITH_1_AND_16_SUBSTEPS;
BENCHMARK(error_in_turbulence)
    ->Arg(100'000)
    ->Arg(200'000)
    ->Arg(1'000'000)
    ->ArgName("points")
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rapid

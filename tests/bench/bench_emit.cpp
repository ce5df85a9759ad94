// Births a second of the emit node by itself: a frame's births from a mesh's surface, with what most scenes ask for.
//
// The numbers are births a second of wall time; the threads are those that the arena has.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/shapes/mesh.h"

namespace rapid {
namespace {

constexpr double births_a_frame = 1 << 20;

std::map<std::string, Value> plain(const char* birth)
{
    return {{"source", ObjectPtr(make_torus(1, 0.3, 50, Vec3d::Zero()))}, {"count", births_a_frame}, {"birth", birth}};
}

std::map<std::string, Value> sparks()
{
    auto life = std::make_shared<Table>();
    life->list = {1.0, 2.0};
    auto arguments = plain("random");
    arguments["speed"] = 5.0;
    arguments["spread"] = 20.0;
    arguments["life"] = std::shared_ptr<const Table>(life);
    return arguments;
}

void emit(benchmark::State& state, std::map<std::string, Value> arguments)
{
    const Registry registry;
    const Node node{&registry.at("emit"), "emit1", {}, 0, {}, std::move(arguments)};
    const auto op = node.type->make();
    const auto simulation = std::make_shared<Simulation>();
    FrameFigures figures;
    std::vector<std::string> warnings;
    const std::function<void(const std::string&, const PointSet&)> no_write;
    std::int64_t frame = 1;
    bind_arguments(node, *op, simulation->frame(frame), false);
    op->check();

    tbb::task_arena arena(static_cast<int>(state.range(0)));
    for (auto _ : state) {
        const Evaluation now{simulation->frame(++frame), false,   node.name, node.location,
                             RandomKey(0, node.name),    figures, warnings,  no_write};
        Flow input{PointSet(), {}, simulation};
        arena.execute([&] { benchmark::DoNotOptimize(op->evaluate({&input, 1}, now).points.size()); });
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(figures.born));
}

BENCHMARK_CAPTURE(emit, begin, plain("begin"))->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(emit, random, plain("random"))->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(emit, sparks, sparks())->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rapid

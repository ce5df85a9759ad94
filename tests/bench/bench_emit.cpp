// Births per second of the emit node alone: a frame's births from a mesh's surface, with the attributes that most
// scenes use.
//
// Births are counted per second of wall time, on all threads of the arena.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "runtime/graph/arguments.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/registry.h"
#include "runtime/shapes/mesh/mesh_sequence.h"
#include "runtime/shapes/motion/animated.h"

namespace rapid {
namespace {

constexpr double births_per_frame = 1 << 20;

std::map<std::string, Value> plain(const char* birth)
{
    return {
        {"source", ObjectPtr(make_torus(1, 0.3, 50, Vec3d::Zero()))}, {"count", births_per_frame}, {"birth", birth}};
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

// A rotating torus of 5,000 faces, and the same as files of its frames, so that each birth has the spline of its face.
std::map<std::string, Value> moving(bool deforming)
{
    const MeshPtr torus = make_torus(1, 0.25, 100, Vec3d::Zero());
    const auto turned = [](double angle) {
        return Pose{Vec3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3d::UnitX()))};
    };
    const MotionPtr motion = keyed_motion({{0, turned(0)}, {1000, turned(2)}});
    auto arguments = plain("random");
    if (!deforming) {
        arguments["source"] = ObjectPtr(std::make_shared<AnimatedMesh>(torus, motion));
        return arguments;
    }
    const auto folder = std::filesystem::temp_directory_path() / fmt::format("rapid_bench_{}", getpid());
    std::filesystem::create_directories(folder);
    std::map<int, std::filesystem::path> files;
    for (int frame = 1; frame <= 3; ++frame) {
        std::string text;
        for (const Vec3f& P : torus->positions) text += fmt::format("v {} {} {}\n", P.x(), P.y() * float(frame), P.z());
        for (const Mesh::Triangle& t : torus->triangles)
            text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        files[frame] = folder / fmt::format("{}.obj", frame);
        std::ofstream(files[frame]) << text;
    }
    const auto sequence = std::make_shared<MeshSequence>(files, "#.obj");
    for (int frame = 1; frame <= 3; ++frame) sequence->at(frame);
    std::filesystem::remove_all(folder);
    arguments["source"] = ObjectPtr(std::make_shared<AnimatedMesh>(sequence, motion));
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
    bind_arguments(node, *op, simulation->clock(), simulation->frame(frame), false);
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

BENCHMARK_CAPTURE(emit, moving, moving(false))->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(emit, deforming, moving(true))->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

// 100,000 parents, each of which emits ten points in a frame along its path.
void parents(benchmark::State& state, const char* birth, const char* event)
{
    constexpr std::size_t size = 100000;
    const auto source = std::make_shared<Simulation>(), own = std::make_shared<Simulation>();
    source->record = std::make_shared<StepRecord>();
    PointSet before, after;
    for (PointSet* set : {&before, &after}) {
        set->append(size);
        const std::span<std::int64_t> id = set->id().overwrite();
        const std::span<Vec3f> P = set->P().overwrite(), v = set->v().overwrite();
        for (std::size_t i = 0; i < size; ++i) {
            id[i] = static_cast<std::int64_t>(i);
            P[i] = {static_cast<float>(i), set == &after ? 1.0f : 0.0f, 0};
            v[i] = {0, 24, 0};
        }
    }
    source->record->time = source->record->h = 1.0 / 24;
    source->record->before = before;

    const Registry registry;
    const Node chain{&registry.at("create"), "create1", {}, 0, {}, {}};
    std::map<std::string, Value> arguments{
        {"from", ObjectPtr(std::make_shared<NodeHandle>(std::make_shared<const Node>(chain)))}, {"count", 10.0}};
    if (*event)
        arguments["on"] = std::string(event);
    else
        arguments["birth"] = std::string(birth);
    arguments["velocity"] = Vec3d(0, 1, 0);
    arguments["spread"] = 30.0;
    const Node node{&registry.at("spawn"), "emit1", {}, 1, {}, std::move(arguments)};
    const auto op = node.type->make();
    FrameFigures figures;
    std::vector<std::string> warnings;
    const std::function<void(const std::string&, const PointSet&)> no_write;
    bind_arguments(node, *op, own->clock(), own->frame(1), false);
    op->check();
    tbb::task_arena arena(static_cast<int>(state.range(0)));
    for (auto _ : state) {
        const Evaluation now{own->frame(2),           false,   node.name, node.location,
                             RandomKey(0, node.name), figures, warnings,  no_write};
        Flow inputs[] = {{PointSet(), {}, own}, {after, {}, source}};
        arena.execute([&] { benchmark::DoNotOptimize(op->evaluate(inputs, now).points.size()); });
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(figures.born));
}

BENCHMARK_CAPTURE(parents, even, "even", "")->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(parents, random, "random", "")->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(parents, birth, "", "birth")->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rapid

// The cost of embedding Rapid: the figures that docs/host.md promises.
//
//   open             opening and closing the C handle of a nearly empty scene; below 10 ms
//   advance          advancing and releasing a frame of one point through the C interface
//   column           getting P of a frame of ten million points; below 10 µs
//   open_many        100,000 scenes, opened and closed: `growth` is what the second half adds to the process's
//                    resident memory, in MiB
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <fstream>

#include "include/rapid/rapid.h"

namespace {

constexpr char one_point[] =
    "local rapid = require 'rapid'\n"
    "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :solve {}";
constexpr char ten_million[] =
    "local rapid = require 'rapid'\n"
    "return rapid.create { points = rapid.points.grid { size = {10, 10, 10}, spacing = 0.04641 } } :solve {}";

rapid_scene* opened(const char* text)
{
    rapid_scene* scene = nullptr;
    rapid_error* error = nullptr;
    if (rapid_scene_open_text("bench.lua", text, nullptr, &scene, &error) != RAPID_OK) {
        std::fprintf(stderr, "%s\n", rapid_error_text(error));
        std::exit(1);
    }
    return scene;
}

double resident_mebibytes()
{
    std::ifstream statm("/proc/self/statm");
    double pages = 0;
    statm >> pages >> pages;
    return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void open(benchmark::State& state)
{
    for (auto _ : state) rapid_scene_release(opened(one_point), nullptr);
}
BENCHMARK(open)->Unit(benchmark::kMillisecond);

void advance(benchmark::State& state)
{
    rapid_scene* scene = opened(one_point);
    for (auto _ : state) {
        rapid_frame* frame = nullptr;
        rapid_scene_advance(scene, &frame, nullptr);
        rapid_frame_release(frame, nullptr);
    }
    rapid_scene_release(scene, nullptr);
}
BENCHMARK(advance)->Unit(benchmark::kMicrosecond);

void column(benchmark::State& state)
{
    rapid_scene* scene = opened(ten_million);
    rapid_frame* frame = nullptr;
    rapid_scene_advance(scene, &frame, nullptr);
    rapid_column P = {};
    P.size = sizeof P;
    for (auto _ : state) {
        rapid_frame_column(frame, "P", &P, nullptr);
        benchmark::DoNotOptimize(P.data);
    }
    state.counters["points"] = static_cast<double>(P.count);
    rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
}
BENCHMARK(column)->Unit(benchmark::kMicrosecond);

void open_many(benchmark::State& state)
{
    const auto open_and_close = [](int count) {
        for (int i = 0; i < count; ++i) rapid_scene_release(opened(one_point), nullptr);
    };
    const auto many = static_cast<int>(state.range(0));
    double growth = 0;
    for (auto _ : state) {
        open_and_close(many / 2);
        const double half = resident_mebibytes();
        open_and_close(many / 2);
        growth = resident_mebibytes() - half;
    }
    state.counters["growth"] = growth;
}
BENCHMARK(open_many)->Arg(100000)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace

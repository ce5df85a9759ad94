// Kernels in Lua compared with the same loops in C++, in one run: on one thread, on data in cache, including all the
// work of a node in a frame. Items per second are points; compare the ratios of one run, not figures of different runs.
//
//   in_lua/NAME, in_cpp/NAME    one kernel, and the same loop over the same columns
//   among_eleven/NAME           the same kernel with ten others of different shapes in the scene, run in turn;
//                               `slower` is its median time divided by that in its own scene
//   two_threads/NAME            a million points; `faster` is the least time on one thread divided by that on two
//                               (a busy machine has no second core to give)
//   one_point                   a kernel called on a set of one point
//   worker_state                the start of a worker thread's state, in which the scene's file runs
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>

#include "bindings/host/script_host.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

struct Columns {
    std::span<Vec3f> P, v;
    std::span<float> heat;
    std::size_t size;
};

constexpr double dt = 1.0 / 24;

Vec3d widened(const Vec3f& a) { return a.cast<double>(); }

struct Subject {
    const char* name;
    const char* lua;
    void (*cpp)(const Columns&);  // null for the shapes that only add variety
};

// In double precision, as in Lua. `branching` soon takes the same branch for all points because they all become hot;
// `chance` branches at random, which no processor predicts.
const Subject subjects[] = {
    {"branching",
     "if p.heat > 0.5 then p.v = p.v * 0.98 + g * frame.dt end "
     "p.v = p.v + up:cross(p.P) * 0.1 p.heat = p.heat + frame.dt",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i) {
             if (c.heat[i] > 0.5) c.v[i] = (widened(c.v[i]) * 0.98 + Vec3d(0, -9.81, 0) * dt).cast<float>();
             c.v[i] = (widened(c.v[i]) + Vec3d(0, 1, 0).cross(widened(c.P[i])) * 0.1).cast<float>();
             c.heat[i] = static_cast<float>(c.heat[i] + dt);
         }
     }},
    {"chance",
     "if p.P.x > 0 then p.v = p.v * 0.98 + g * frame.dt end "
     "p.v = p.v + up:cross(p.P) * 0.1 p.heat = p.heat + frame.dt",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i) {
             if (c.P[i].x() > 0) c.v[i] = (widened(c.v[i]) * 0.98 + Vec3d(0, -9.81, 0) * dt).cast<float>();
             c.v[i] = (widened(c.v[i]) + Vec3d(0, 1, 0).cross(widened(c.P[i])) * 0.1).cast<float>();
             c.heat[i] = static_cast<float>(c.heat[i] + dt);
         }
     }},
    {"damp", "p.v = p.v * 0.99",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i) c.v[i] = (widened(c.v[i]) * 0.99).cast<float>();
     }},
    {"advance", "p.P = p.P + p.v * frame.dt",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i) c.P[i] = (widened(c.P[i]) + widened(c.v[i]) * dt).cast<float>();
     }},
    {"clamp", "p.heat = rapid.math.clamp(p.heat * 1.01, 0, 1)",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i)
             c.heat[i] = static_cast<float>(std::clamp(c.heat[i] * 1.01, 0.0, 1.0));
     }},
    {"length", "p.heat = p.v:length()",
     [](const Columns& c) {
         for (std::size_t i = 0; i < c.size; ++i) c.heat[i] = static_cast<float>(widened(c.v[i]).norm());
     }},
    {"helper", "p.v = push(p, 0.1)", nullptr},
    {"loop", "local x = p.heat for i = 1, 4 do x = x * 0.5 + 0.25 end p.heat = x", nullptr},
    {"random", "p.heat = p:rand(1, frame)", nullptr},
    {"group", "if p.heat > 0.5 then p:join 'hot' else p:leave 'hot' end", nullptr},
    {"height", "if p.P.y < 0 then p.P = vec3(p.P.x, -p.P.y, p.P.z) p.v = vec3(p.v.x, -p.v.y, p.v.z) * 0.9 end",
     nullptr},
};
constexpr std::size_t subject_count = std::size(subjects);

// A scene of kernels. `helper` calls functions that other kernels may call too.
std::string scene_of(const std::vector<const Subject*>& which)
{
    std::string text =
        "local rapid = require 'rapid'\n"
        "local g, up = vec3(0, -9.81, 0), vec3(0, 1, 0)\n"
        "local function push(p, strength) return p.v + vec3(strength, 0, 0):cross(p.P) end\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, heat = {0} } }\n";
    for (const Subject* subject : which)
        text += fmt::format("  :points('{}', function(p, frame) {} end)\n", subject->name, subject->lua);
    return text + "  :solve {}";
}

// A loaded scene, and a point set for each of its kernels.
class Scene {
public:
    Scene(const std::vector<const Subject*>& which, std::size_t n) : folder_(make_folder())
    {
        const std::filesystem::path file = folder_ / "scene.lua";
        std::ofstream(file) << scene_of(which);
        host = std::make_unique<ScriptHost>(file, SessionOptions{});
        std::mt19937 random(1);
        std::uniform_real_distribution<float> in(-1, 1);
        PointSet set;
        set.append(n);
        for (Vec3f& P : set.P().write()) P = {in(random), in(random), in(random)};
        for (Vec3f& v : set.v().write()) v = {in(random), in(random), in(random)};
        std::int64_t id = 0;
        for (std::int64_t& i : set.id().write()) i = id++;
        set.set("heat", Column<float>(n));
        for (float& heat : set.column<float>("heat").write()) heat = 0.5f + 0.5f * in(random);
        sets.assign(which.size(), set);
    }
    ~Scene() { std::filesystem::remove_all(folder_); }

    // Runs a kernel as the node does in a frame.
    void run(std::size_t kernel)
    {
        const Evaluation now{{2, dt, dt}, false, node_, location_, RandomKey(1, node_), figures_, warnings_, nothing_};
        const auto pass = host->kernels[kernel]->prepare(sets[kernel], "", now, {}, {});
        run_passes({&pass, 1}, sets[kernel], false);
    }

    Columns columns()
    {
        PointSet& set = sets.front();
        return {set.P().write(), set.v().write(), set.column<float>("heat").write(), set.size()};
    }

    std::unique_ptr<ScriptHost> host;
    std::vector<PointSet> sets;  // by kernel

private:
    static std::filesystem::path make_folder()
    {
        std::string name = (std::filesystem::temp_directory_path() / "bench_kernels.XXXXXX").string();
        if (!mkdtemp(name.data())) throw std::runtime_error("no folder for the scene");
        return name;
    }

    const std::filesystem::path folder_;
    const std::string node_ = "bench";
    const Location location_{"scene.lua", 1};
    FrameFigures figures_;
    std::vector<std::string> warnings_;
    const std::function<void(const std::string&, const PointSet&)> nothing_;
};

double seconds_of(const std::function<void()>& f)
{
    const auto begin = std::chrono::steady_clock::now();
    f();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double median(std::vector<double> times)
{
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
    return times[times.size() / 2];
}

constexpr std::size_t in_cache = 16384;  // points: 450 KB
constexpr int warm = 40;                 // runs in which traces are compiled, and recompiled once
constexpr int samples = 200;

void in_lua(benchmark::State& state, const Subject& subject)
{
    Threads one(1);
    one.run([&] {
        Scene scene({&subject}, in_cache);
        for (int i = 0; i < warm; ++i) scene.run(0);
        for (auto _ : state) scene.run(0);
    });
    state.SetItemsProcessed(state.iterations() * in_cache);
}

void in_cpp(benchmark::State& state, const Subject& subject)
{
    Scene scene({&subject}, in_cache);
    const Columns columns = scene.columns();
    for (auto _ : state) {
        subject.cpp(columns);
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * in_cache);
}

void among_eleven(benchmark::State& state, std::size_t which)
{
    Threads one(1);
    one.run([&] {
        std::vector<const Subject*> all;
        for (const Subject& subject : subjects) all.push_back(&subject);
        Scene together(all, in_cache), alone({all[which]}, in_cache);
        const auto all_once = [&](std::vector<double>* times) {
            for (std::size_t k = 0; k < subject_count; ++k) {
                const double seconds = seconds_of([&] { together.run(k); });
                if (times && k == which) times->push_back(seconds);
            }
        };
        for (int i = 0; i < warm; ++i) all_once(nullptr), alone.run(0);
        std::vector<double> among, by_itself;
        for (int i = 0; i < samples; ++i) {
            all_once(&among);
            by_itself.push_back(seconds_of([&] { alone.run(0); }));
        }
        for (auto _ : state) state.SetIterationTime(median(among));
        state.counters["slower"] = median(among) / median(by_itself);
    });
    state.SetItemsProcessed(state.iterations() * in_cache);
}

void two_threads(benchmark::State& state, const Subject& subject)
{
    constexpr std::size_t million = 1'000'000;
    const auto timed = [&](int threads) {
        return Threads(threads).run([&] {
            Scene scene({&subject}, million);
            for (int i = 0; i < warm; ++i) scene.run(0);
            std::vector<double> times;
            for (int i = 0; i < samples; ++i) times.push_back(seconds_of([&] { scene.run(0); }));
            return *std::ranges::min_element(times);
        });
    };
    const double one = timed(1), two = timed(2);
    for (auto _ : state) state.SetIterationTime(two);
    state.counters["faster"] = one / two;
    state.SetItemsProcessed(state.iterations() * million);
}

void one_point(benchmark::State& state)
{
    Threads one(1);
    one.run([&] {
        Scene scene({&subjects[0]}, 1);
        for (int i = 0; i < 1000; ++i) scene.run(0);
        for (auto _ : state) scene.run(0);
    });
}
BENCHMARK(one_point);

void worker_state(benchmark::State& state)
{
    for (auto _ : state) {
        state.PauseTiming();
        Scene scene({&subjects[0], &subjects[6], &subjects[8]}, 1);
        state.ResumeTiming();
        scene.host->second();
    }
}
BENCHMARK(worker_state)->Unit(benchmark::kMillisecond);

const bool registered = [] {
    for (std::size_t k = 0; k < subject_count; ++k) {
        const Subject& subject = subjects[k];
        const auto named = [&](const char* what) { return fmt::format("{}/{}", what, subject.name); };
        benchmark::RegisterBenchmark(named("in_lua").c_str(), [&](benchmark::State& s) { in_lua(s, subject); });
        if (subject.cpp)
            benchmark::RegisterBenchmark(named("in_cpp").c_str(), [&](benchmark::State& s) { in_cpp(s, subject); });
        benchmark::RegisterBenchmark(named("among_eleven").c_str(), [k](benchmark::State& s) { among_eleven(s, k); })
            ->UseManualTime()
            ->Iterations(1);
        benchmark::RegisterBenchmark(named("two_threads").c_str(),
                                     [&](benchmark::State& s) { two_threads(s, subject); })
            ->UseManualTime()
            ->Iterations(1);
    }
    return true;
}();

}  // namespace
}  // namespace rapid

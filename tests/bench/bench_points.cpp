// The cost of a frame's operations on a point set: births, deaths, and a copy in which one column is written; and the
// search for neighbours.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <optional>
#include <string>

#include "runtime/math/random.h"
#include "runtime/points/neighbours.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/contact_search.h"

namespace rapid {
namespace {

// P, v, id and seven floats, none of them uniform: 60 bytes a point.
PointSet ten_columns(std::size_t size)
{
    PointSet points;
    points.append(size);
    for (int i = 0; i < 7; ++i) points.add({fmt::format("f{}", i), 0.0f});
    for (const std::string& name : points.column_names())
        std::visit([](auto& column) { column.write(); }, *points.find(name));
    return points;
}

// Appends 48 frames of an emitter's births to an empty set.
void append(benchmark::State& state)
{
    const auto births = static_cast<std::size_t>(state.range(0));
    constexpr int frames = 48;
    for (auto _ : state) {
        PointSet points;
        for (int frame = 0; frame < frames; ++frame) {
            const std::size_t before = points.size();
            points.append(births);
            auto P = points.P().write();
            auto v = points.v().write();
            auto id = points.id().write();
            for (std::size_t i = before; i < points.size(); ++i) {
                P[i] = Vec3f(0, 1, 0);
                v[i] = Vec3f(0, 2, 0);
                id[i] = static_cast<std::int64_t>(i);
            }
        }
        benchmark::DoNotOptimize(points);
    }
    state.SetItemsProcessed(state.iterations() * frames * static_cast<std::int64_t>(births));
}
BENCHMARK(append)->Arg(2000)->Arg(20000)->Arg(200000)->Unit(benchmark::kMillisecond)->UseRealTime();

// Kills a tenth of the points, spread over the set.
void kill_a_tenth(benchmark::State& state)
{
    const auto size = static_cast<std::size_t>(state.range(0));
    std::vector<std::uint8_t> keep(size);
    for (std::size_t i = 0; i < size; ++i) keep[i] = uniform4(RandomKey(7, "kill"), i, 0)[0] >= 0.1;
    for (auto _ : state) {
        state.PauseTiming();
        PointSet points = ten_columns(size);
        state.ResumeTiming();
        points.keep(keep);
        state.PauseTiming();
        points = PointSet();
        state.ResumeTiming();
    }
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(kill_a_tenth)->Arg(10000)->Arg(1000000)->Unit(benchmark::kMillisecond)->UseRealTime();

void copy_and_write_one(benchmark::State& state)
{
    const PointSet original = ten_columns(static_cast<std::size_t>(state.range(0)));
    for (auto _ : state) {
        PointSet copy = original;
        for (float& value : copy.column<float>("f3").write()) value += 1;
        benchmark::DoNotOptimize(copy);
    }
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(copy_and_write_one)->Arg(10000)->Arg(1000000)->Unit(benchmark::kMillisecond)->UseRealTime();

// A lattice of points a metre apart, each displaced by up to 0.3 m along each axis, in lattice order.
std::vector<Vec3f> jittered_lattice(int edge)
{
    std::vector<Vec3f> P;
    const RandomKey key(7, "lattice");
    for (int x = 0; x < edge; ++x)
        for (int y = 0; y < edge; ++y)
            for (int z = 0; z < edge; ++z) {
                const auto u = uniform4(key, P.size(), 0);
                const Vec3d moved = 0.6 * (Vec3d(u[0], u[1], u[2]) - Vec3d::Constant(0.5));
                P.push_back((Vec3d(x, y, z) + moved).cast<float>());
            }
    return P;
}

constexpr double reach = 1.1;  // m, of the neighbour search; about six neighbours each

// On one thread: the per-point work of :interact and :detail, and the search for contacts among as many grains.
void find_neighbours(benchmark::State& state)
{
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const std::vector<Vec3f> P = jittered_lattice(static_cast<int>(state.range(0)));
    for (auto _ : state) {
        std::size_t pairs = 0;
        Neighbours(P, reach).for_each(
            [&](std::uint32_t, const std::vector<std::uint32_t>& near) { pairs += near.size(); });
        benchmark::DoNotOptimize(pairs);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(P.size()));
}
BENCHMARK(find_neighbours)->Arg(100)->Unit(benchmark::kMillisecond);

void find_contacts(benchmark::State& state)
{
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    std::vector<Vec3d> P;
    for (const Vec3f& at : jittered_lattice(static_cast<int>(state.range(0)))) P.push_back(at.cast<double>());
    const float radius = reach / 2;
    const Strided<float> radii{&radius, 0};
    ContactSearch search;
    Pairs pairs;
    for (auto _ : state) {
        const RadiusGrids grids(radii, P.size(), std::nullopt, 1);
        search.find(P, radii, grids, pairs);
        benchmark::DoNotOptimize(pairs);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(P.size()));
}
BENCHMARK(find_contacts)->Arg(100)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rapid

// Solve compared with the memory limit in one run: free fall against a hand-written loop over the same arrays, and the
// cost of colliders that points are far from, rest on, slide on, and fall on. Items per second are point-frames;
// compare the ratios of one run, not figures of different runs.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <memory>
#include <random>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/solver/solve.h"
#include "tests/solver/motion/uniform_force.h"

namespace rapid {
namespace {

std::shared_ptr<const Collider> collider(const ShapePtr& shape, float bounce, float friction)
{
    auto made = std::make_shared<Collider>();
    made->shape = shape;
    made->bounce = bounce;
    made->friction = friction;
    return made;
}

std::shared_ptr<const Collider> ground(float friction = 0)
{
    return collider(make_plane({0, 1, 0}, 0), 0.3f, friction);
}

// 188,000 active voxels, one metre above the ground.
const ShapePtr& ball()
{
    static const ShapePtr made = level_set_sphere(1, {0, 2, 0}, {0.02, 3});
    return made;
}

// Points in a box around a height, with velocities of up to `speed` m/s per axis.
PointSet points(std::size_t n, float height, float spread, float speed)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<float> in(-1, 1);
    PointSet set;
    set.append(n);
    for (Vec3f& P : set.P().write())
        P = Vec3f(spread * in(random), height + (height > 0 ? spread * in(random) : 0), spread * in(random));
    for (Vec3f& v : set.v().write()) v = speed * Vec3f(in(random), height > 0 ? in(random) : 0, in(random));
    return set;
}

// Repeats one frame of 1/24 s from the same state, on the number of threads given by the benchmark's argument. The time
// to restore the state between frames is not counted.
void advance(benchmark::State& state, PointSet start, Dynamics dynamics, int substeps = 1, int warm = 0)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    dynamics.add(std::make_shared<test::UniformForce>());
    SolveOptions options;
    options.h = 1.0 / 24;
    options.substeps = substeps;
    for (int f = 0; f < warm; ++f) solve(start, dynamics, options);
    PointSet set = start;
    for (auto _ : state) {
        state.PauseTiming();
        std::copy_n(start.P().read().data, start.size(), set.P().write().begin());
        std::copy_n(start.v().read().data, start.size(), set.v().write().begin());
        state.ResumeTiming();
        solve(set, dynamics, options);
    }
    state.SetItemsProcessed(state.iterations() * start.size());
}

constexpr std::size_t million = 1'000'000;

void free_fall_by_hand(benchmark::State& state)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    PointSet set = points(10 * million, 10, 10, 1);
    float* P = set.P().write().data()->data();
    float* v = set.v().write().data()->data();
    const float dt = 1.0f / 24, g[3] = {0, -9.81f * dt, 0};
    for (auto _ : state)
        for_each_chunk(set.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = 3 * begin; i < 3 * end; i += 3)
                for (int k = 0; k < 3; ++k) {
                    v[i + k] += g[k];
                    P[i + k] += v[i + k] * dt;
                }
        });
    state.SetItemsProcessed(state.iterations() * set.size());
}

void fall_for(benchmark::State& state, int substeps, bool newborn)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    PointSet set = points(10 * million, 10, 10, 1);
    if (newborn) {
        set.add({"dt", 1.0f / 24});
        set.column<float>("dt").write()[0] = 0.01f;
    }
    const Dynamics dynamics = test::chain(std::make_shared<test::UniformForce>());
    SolveOptions options;
    options.h = 1.0 / 24;
    options.substeps = substeps;
    for (auto _ : state) solve(set, dynamics, options);
    state.SetItemsProcessed(state.iterations() * set.size());
}
void free_fall_rapid(benchmark::State& state) { fall_for(state, 1, false); }
void free_fall_rapid_16_substeps(benchmark::State& state) { fall_for(state, 16, false); }
void free_fall_rapid_with_newborn(benchmark::State& state) { fall_for(state, 1, true); }

void nothing_to_hit(benchmark::State& state) { advance(state, points(million, 50, 10, 1), {}); }
void far_from_level_set(benchmark::State& state)
{
    advance(state, points(million, 50, 10, 1), test::chain(collider(ball(), 0.4f, 0.2f)));
}
void far_from_level_set_and_ground(benchmark::State& state)
{
    advance(state, points(million, 50, 10, 1), test::chain(collider(ball(), 0.4f, 0.2f), ground()));
}
void in_the_box_of_level_set(benchmark::State& state)
{
    advance(state, points(million, 2, 1.2f, 1), test::chain(collider(ball(), 0.4f, 0.2f)));
}
void resting_on_ground(benchmark::State& state)
{
    advance(state, points(million, 0, 10, 0), test::chain(ground()), 1, 1);
}
void sliding_on_ground(benchmark::State& state)
{
    advance(state, points(million, 0, 10, 1), test::chain(ground()), 1, 1);
}
void sliding_on_ground_with_friction(benchmark::State& state)
{
    advance(state, points(million, 0, 10, 10), test::chain(ground(0.1f)), 1, 1);
}
void sliding_on_ground_near_level_set(benchmark::State& state)
{
    advance(state, points(million, 0, 3, 1), test::chain(collider(ball(), 0.4f, 0.2f), ground()), 1, 1);
}
void falling_on_ground(benchmark::State& state)
{
    advance(state, points(million, 0.2f, 0.2f, 1), test::chain(ground()), 1, 4);
}
void falling_on_level_set(benchmark::State& state)
{
    advance(state, points(million, 4, 0.8f, 1), test::chain(collider(ball(), 0.4f, 0.2f), ground()), 1, 8);
}

#define ON_1_AND_2_THREADS Arg(1)->Arg(2)->ArgName("threads")->UseRealTime()->Unit(benchmark::kMillisecond)
BENCHMARK(free_fall_by_hand)->ON_1_AND_2_THREADS;
BENCHMARK(free_fall_rapid)->ON_1_AND_2_THREADS;
BENCHMARK(free_fall_rapid_16_substeps)->ON_1_AND_2_THREADS;
BENCHMARK(free_fall_rapid_with_newborn)->ON_1_AND_2_THREADS;
BENCHMARK(nothing_to_hit)->ON_1_AND_2_THREADS;
BENCHMARK(far_from_level_set)->ON_1_AND_2_THREADS;
BENCHMARK(far_from_level_set_and_ground)->ON_1_AND_2_THREADS;
BENCHMARK(in_the_box_of_level_set)->ON_1_AND_2_THREADS;
BENCHMARK(resting_on_ground)->ON_1_AND_2_THREADS;
BENCHMARK(sliding_on_ground)->ON_1_AND_2_THREADS;
BENCHMARK(sliding_on_ground_with_friction)->ON_1_AND_2_THREADS;
BENCHMARK(sliding_on_ground_near_level_set)->ON_1_AND_2_THREADS;
BENCHMARK(falling_on_ground)->ON_1_AND_2_THREADS;
BENCHMARK(falling_on_level_set)->ON_1_AND_2_THREADS;

}  // namespace
}  // namespace rapid

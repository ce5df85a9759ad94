// Asking a level set for distance and gradient, against OpenVDB's own stencil and a dense array, in one run: a sphere
// of 188,000 active voxels (radius 1 m, voxel 0.02 m), points within a voxel of its surface in random order, or far
// outside. Items per second are points; compare the ratios of one run, not figures of different ones.
#include <benchmark/benchmark.h>
#include <openvdb/math/Stencils.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <memory>
#include <random>
#include <vector>

#include "runtime/parallel.h"
#include "runtime/shapes/level_set.h"
#include "runtime/shapes/scatter.h"

namespace rapid {
namespace {

constexpr std::size_t n = 1'000'000;
constexpr double radius = 1.0, voxel = 0.02;

const std::vector<Vec3d>& points_near()
{
    static const auto points = [] {
        std::mt19937_64 random(1);
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<double> offset(-voxel, voxel);
        std::vector<Vec3d> made(n);
        for (Vec3d& P : made) {
            P = Vec3d(normal(random), normal(random), normal(random));
            P *= (radius + offset(random)) / P.norm();
        }
        return made;
    }();
    return points;
}

const std::vector<Vec3d>& points_far()
{
    static const auto points = [] {
        auto made = points_near();
        for (Vec3d& P : made) P *= 5;
        return made;
    }();
    return points;
}

const ShapePtr& sphere()
{
    static const ShapePtr made = level_set_sphere(radius, Vec3d::Zero(), {voxel, 3});
    return made;
}

// The same field in one array, and the same interpolation: what memory allows.
struct Dense {
    std::vector<float> values;
    int size = 0;
    double origin = 0;

    Dense()
    {
        size = static_cast<int>(2 * radius / voxel) + 10;
        origin = -voxel * size / 2;
        for (int i = 0; i < size; ++i)
            for (int j = 0; j < size; ++j)
                for (int k = 0; k < size; ++k)
                    values.push_back(float((Vec3d(i, j, k) * voxel + Vec3d::Constant(origin)).norm() - radius));
    }

    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        const Vec3d x = (P - Vec3d::Constant(origin)) / voxel;
        const int i = static_cast<int>(x[0]), j = static_cast<int>(x[1]), k = static_cast<int>(x[2]);
        const auto fx = float(x[0] - i), fy = float(x[1] - j), fz = float(x[2] - k);
        const float* c = values.data() + (std::size_t(i) * size + j) * size + k;
        const int row = size, slab = size * size;
        const float d00 = c[1] - c[0], d01 = c[row + 1] - c[row];
        const float d10 = c[slab + 1] - c[slab], d11 = c[slab + row + 1] - c[slab + row];
        const float c00 = c[0] + fz * d00, c01 = c[row] + fz * d01;
        const float c10 = c[slab] + fz * d10, c11 = c[slab + row] + fz * d11;
        const float dy0 = c01 - c00, dy1 = c11 - c10;
        const float c0 = c00 + fy * dy0, c1 = c10 + fy * dy1;
        const float dz0 = d00 + fy * (d01 - d00), dz1 = d10 + fy * (d11 - d10);
        gradient = Vec3d(c1 - c0, dy0 + fx * (dy1 - dy0), dz0 + fx * (dz1 - dz0)) / voxel;
        return c0 + fx * (c1 - c0);
    }
};

// Runs `ask` over all points in chunks, on the threads that the benchmark's argument says.
template <class Ask>
void run(benchmark::State& state, const std::vector<Vec3d>& points, const Ask& ask)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    std::vector<double> phi(n);
    std::vector<Vec3d> gradient(n);
    for (auto _ : state) {
        for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
            ask(std::span(points).subspan(begin, end - begin), std::span(phi).subspan(begin, end - begin),
                std::span(gradient).subspan(begin, end - begin));
        });
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * n);
}

void ask_stencil(benchmark::State& state, const std::vector<Vec3d>& points)
{
    openvdb::initialize();
    const auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(radius, openvdb::Vec3f(0), voxel, 3);
    run(state, points, [&](std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) {
        openvdb::math::BoxStencil<const openvdb::FloatGrid> stencil(*grid);
        for (std::size_t i = 0; i < P.size(); ++i) {
            const openvdb::Vec3d at(P[i].x() / voxel, P[i].y() / voxel, P[i].z() / voxel);
            stencil.moveTo(openvdb::Coord::floor(at));
            phi[i] = stencil.interpolation(at);
            const auto g = stencil.gradient(at);
            gradient[i] = {g[0], g[1], g[2]};
        }
    });
}

void near_surface_rapid(benchmark::State& state)
{
    run(state, points_near(), [](auto P, auto phi, auto gradient) { sphere()->distance(P, phi, gradient); });
}
void near_surface_box_stencil(benchmark::State& state) { ask_stencil(state, points_near()); }
void near_surface_dense_array(benchmark::State& state)
{
    const Dense dense;
    run(state, points_near(), [&](auto P, auto phi, auto gradient) {
        for (std::size_t i = 0; i < P.size(); ++i) phi[i] = dense.distance(P[i], gradient[i]);
    });
}
void far_outside_rapid(benchmark::State& state)
{
    run(state, points_far(), [](auto P, auto phi, auto gradient) { sphere()->distance(P, phi, gradient); });
}
void far_outside_box_stencil(benchmark::State& state) { ask_stencil(state, points_far()); }

// The whole of it: the tree, and its baked copy.
void build_sphere(benchmark::State& state)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    for (auto _ : state) benchmark::DoNotOptimize(level_set_sphere(radius, Vec3d::Zero(), {voxel, 3}));
    state.counters["voxels"] = double(level_set_sphere(radius, Vec3d::Zero(), {voxel, 3})->active_voxels());
}

void build_from_mesh(benchmark::State& state)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    const MeshPtr mesh = make_sphere(radius, 70, Vec3d::Zero());  // 4,760 triangles
    std::vector<std::string> warnings;
    for (auto _ : state) benchmark::DoNotOptimize(level_set_from_mesh(mesh, {voxel, 3}, warnings));
}

void births(benchmark::State& state, const ScatterPtr& scatter)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    std::vector<Birthplace> out(n);
    for (auto _ : state) {
        for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
            scatter->place(RandomKey(1, "emit"), begin, std::span(out).subspan(begin, end - begin));
        });
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * n);
}

void births_on_mesh(benchmark::State& state) { births(state, scatter_on_surface(make_sphere(1, 70, Vec3d::Zero()))); }
void births_in_mesh(benchmark::State& state) { births(state, scatter_in_volume(make_sphere(1, 70, Vec3d::Zero()))); }
void births_on_level_set(benchmark::State& state) { births(state, scatter_on_surface(sphere())); }
void births_in_level_set(benchmark::State& state) { births(state, scatter_in_volume(sphere())); }

#define ON_1_AND_2_THREADS Arg(1)->Arg(2)->ArgName("threads")->UseRealTime()->Unit(benchmark::kMillisecond)
BENCHMARK(near_surface_rapid)->ON_1_AND_2_THREADS;
BENCHMARK(near_surface_box_stencil)->ON_1_AND_2_THREADS;
BENCHMARK(near_surface_dense_array)->ON_1_AND_2_THREADS;
BENCHMARK(far_outside_rapid)->ON_1_AND_2_THREADS;
BENCHMARK(far_outside_box_stencil)->ON_1_AND_2_THREADS;
BENCHMARK(build_sphere)->ON_1_AND_2_THREADS;
BENCHMARK(build_from_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(births_on_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(births_in_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(births_on_level_set)->ON_1_AND_2_THREADS;
BENCHMARK(births_in_level_set)->ON_1_AND_2_THREADS;

}  // namespace
}  // namespace rapid

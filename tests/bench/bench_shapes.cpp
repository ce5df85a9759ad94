// Queries of distance and gradient of a level set, compared with OpenVDB's own stencil and a dense array in one run: a
// sphere of 188,000 active voxels (radius 1 m, voxel 0.02 m), with points within a voxel of its surface in random
// order, or far outside. Items per second are points; compare the ratios of one run, not figures of different runs.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <openvdb/math/Stencils.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/shapes/mesh/mesh_sequence.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/scatter/scatter.h"

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

// The same points, sorted by blocks of 8 voxels: the possible gain from storing points in this order.
const std::vector<Vec3d>& points_in_order()
{
    static const auto points = [] {
        auto made = points_near();
        const auto block = [](const Vec3d& P) {
            const Eigen::Vector3i at = (P / (8 * voxel)).array().floor().cast<int>();
            return std::array{at.x(), at.y(), at.z()};
        };
        std::sort(made.begin(), made.end(), [&](const Vec3d& a, const Vec3d& b) { return block(a) < block(b); });
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

// The same field in one array with the same interpolation: the limit set by memory.
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

// Runs `query` over all points in chunks, on the number of threads given by the benchmark's argument.
template <class Query>
void run(benchmark::State& state, const std::vector<Vec3d>& points, const Query& query)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    std::vector<double> phi(n);
    std::vector<Vec3d> gradient(n);
    for (auto _ : state) {
        for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
            query(std::span(points).subspan(begin, end - begin), std::span(phi).subspan(begin, end - begin),
                  std::span(gradient).subspan(begin, end - begin));
        });
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * n);
}

void query_stencil(benchmark::State& state, const std::vector<Vec3d>& points)
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
void near_surface_rapid_in_order(benchmark::State& state)
{
    run(state, points_in_order(), [](auto P, auto phi, auto gradient) { sphere()->distance(P, phi, gradient); });
}
void near_surface_box_stencil(benchmark::State& state) { query_stencil(state, points_near()); }
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
void far_outside_box_stencil(benchmark::State& state) { query_stencil(state, points_far()); }

// Builds both the tree and its baked copy.
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

// A body of 5,000 vertices in 0.02 m voxels that deforms and turns every frame, compared with the time of OpenVDB alone
// for a band of that width.
MeshPtr body() { return make_torus(0.6, 0.2, 120, Vec3d::Zero()); }

void deform_rapid(benchmark::State& state)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    const auto folder = std::filesystem::temp_directory_path() / fmt::format("rapid_bench_{}", getpid());
    std::filesystem::create_directories(folder);
    std::map<int, std::filesystem::path> files;
    const MeshPtr rest = body();
    for (int frame = 1; frame <= 2; ++frame) {
        std::string text;
        for (const Vec3f& P : rest->positions)
            text += fmt::format("v {} {} {}\n", P.x(), P.y() * (1 + 0.05 * frame), P.z());
        for (const Mesh::Triangle& t : rest->triangles)
            text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        files[frame] = folder / fmt::format("{}.obj", frame);
        std::ofstream(files[frame]) << text;
    }
    const auto sequence = std::make_shared<MeshSequence>(files, "#.obj");

    const auto turned = [](double angle) {
        return Pose{Vec3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3d::UnitX()))};
    };
    const auto mesh = std::make_shared<AnimatedMesh>(sequence, keyed_motion({{0, turned(0)}, {100000, turned(3)}}));
    std::vector<std::string> warnings;
    Deformation deformation(std::make_shared<DeformingLevelSet>(mesh, LevelSetOptions{voxel, 3}, warnings));
    double frame = 1;
    deformation.over({24, 1}, frame, frame + 1, nullptr, {}, 0);
    for (auto _ : state) {
        ++frame;
        benchmark::DoNotOptimize(deformation.over({24, 1}, frame, frame + 1, nullptr, {}, 0));
    }
    std::filesystem::remove_all(folder);
    state.counters["vertices"] = double(rest->positions.size());
    state.counters["voxels"] = double(deformation.at_end()->active_voxels());
}

void deform_mesh_to_volume(benchmark::State& state)
{
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, state.range(0));
    openvdb::initialize();
    const MeshPtr mesh = body();
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    for (const Vec3f& P : mesh->positions) points.emplace_back(P.x() / voxel, P.y() / voxel, P.z() / voxel);
    for (const Mesh::Triangle& t : mesh->triangles) faces.emplace_back(t[0], t[1], t[2]);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, faces);
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    for (auto _ : state)
        benchmark::DoNotOptimize(openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, 3, 3));
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
BENCHMARK(near_surface_rapid_in_order)->ON_1_AND_2_THREADS;
BENCHMARK(near_surface_box_stencil)->ON_1_AND_2_THREADS;
BENCHMARK(near_surface_dense_array)->ON_1_AND_2_THREADS;
BENCHMARK(far_outside_rapid)->ON_1_AND_2_THREADS;
BENCHMARK(far_outside_box_stencil)->ON_1_AND_2_THREADS;
BENCHMARK(build_sphere)->ON_1_AND_2_THREADS;
BENCHMARK(build_from_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(deform_rapid)->ON_1_AND_2_THREADS;
BENCHMARK(deform_mesh_to_volume)->ON_1_AND_2_THREADS;
BENCHMARK(births_on_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(births_in_mesh)->ON_1_AND_2_THREADS;
BENCHMARK(births_on_level_set)->ON_1_AND_2_THREADS;
BENCHMARK(births_in_level_set)->ON_1_AND_2_THREADS;

}  // namespace
}  // namespace rapid

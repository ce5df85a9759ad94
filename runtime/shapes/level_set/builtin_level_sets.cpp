// Built-in level sets, evaluated from distance formulas: exact at every voxel of the band.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/level_set/buildable.h"
#include "runtime/shapes/level_set/voxel_blocks.h"

namespace rapid {
namespace {

constexpr double pi = std::numbers::pi;

// A surface given by a function that is its exact distance, or at least has a slope of at most 1.
struct Formula {
    std::string what;  // `a level set sphere of radius 2`
    std::function<double(const Vec3d& P)> distance;
    Box3d bounds;
    double area;       // m²
    double thickness;  // m, thickness of the thinnest part
};

// Finds the blocks that the band may touch. Descends an octree and prunes cubes whose centre is farther from the
// surface than the half width plus half their diagonal. Coordinates are in blocks.
void find_blocks(const Formula& formula, const VoxelFrame& frame, double half_width,
                 const VoxelBlocks::BlockCoord& lowest, int size, std::vector<VoxelBlocks::BlockCoord>& found)
{
    const double half = 0.5 * VoxelBlocks::edge * size;  // voxels
    const Vec3d center = frame.to_world((VoxelBlocks::edge * lowest).cast<double>() + Vec3d::Constant(half));
    if (std::abs(formula.distance(center)) > half_width + std::numbers::sqrt3 * half * frame.voxel) return;
    if (size == 1) {
        found.push_back(lowest);
        return;
    }
    const int h = size / 2;
    for (int n = 0; n < 8; ++n)
        find_blocks(formula, frame, half_width, lowest + h * VoxelBlocks::BlockCoord(n >> 2, n >> 1 & 1, n & 1), h,
                    found);
}

VoxelBlocks measure(const Formula& formula, const LevelSetOptions& options)
{
    constexpr int edge = VoxelBlocks::edge;
    VoxelBlocks blocks{frame_around(formula.bounds, options.voxel), options.half_width * options.voxel, {}, {}, {}};
    const VoxelFrame& frame = blocks.frame;

    const auto block_of = [&](const Vec3d& P) {
        return VoxelBlocks::BlockCoord((frame.to_voxels(P) / edge).array().floor().matrix().cast<int>());
    };
    const Vec3d beyond = Vec3d::Constant(blocks.half_width + frame.voxel);
    const VoxelBlocks::BlockCoord low = block_of(formula.bounds.min() - beyond);
    const VoxelBlocks::BlockCoord across = block_of(formula.bounds.max() + beyond) - low;
    std::vector<VoxelBlocks::BlockCoord> found;
    find_blocks(formula, frame, blocks.half_width, low,
                static_cast<int>(std::bit_ceil(static_cast<unsigned>(across.maxCoeff() + 1))), found);

    blocks.resize(found.size());
    blocks.coords = std::move(found);
    const float background = blocks.background();
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
        const std::span<float, VoxelBlocks::voxels> values = blocks.of(b);
        const VoxelBlocks::BlockCoord lowest = edge * blocks.coords[b];
        for (int v = 0; v < int(VoxelBlocks::voxels); ++v) {
            const VoxelBlocks::BlockCoord voxel =
                lowest + VoxelBlocks::BlockCoord(v / (edge * edge), v / edge % edge, v % edge);
            const auto phi = static_cast<float>(formula.distance(frame.to_world(voxel.cast<double>())));
            const bool is_near = std::abs(phi) < background;
            values[v] = is_near ? phi : std::copysign(background, phi);
            if (is_near) VoxelBlocks::mark(blocks.in_band[b], v);
        }
    });
    blocks.drop_empty([](std::size_t, std::size_t) {});
    return blocks;
}

LevelSetPtr level_set_of(const Formula& formula, const LevelSetOptions& options)
{
    require_buildable(formula.what, formula.area, formula.bounds, options);
    const VoxelBlocks blocks = measure(formula, options);
    const auto grid = [=] { return grid_of_blocks(measure(formula, options)); };
    const auto rebuild = [formula, voxel = options.voxel](double half_width) {
        return level_set_of(formula, {voxel, half_width / voxel});
    };
    return std::make_shared<BakedLevelSet>(bake(blocks), blocks.voxels_in_band(), BakedLevelSet::Source{grid, rebuild});
}

LevelSetPtr make_level_set(const Formula& formula, const LevelSetOptions& options)
{
    require_legal(options);
    if (formula.thickness < options.voxel)
        throw Error(fmt::format("{} vanishes with voxel = {:g} m: it is {:g} m thick; use a voxel of at most {:.3g} m",
                                formula.what, options.voxel, formula.thickness, formula.thickness / 2));
    return level_set_of(formula, options);
}

void require_length(const char* shape, const char* name, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw Error(fmt::format("{} of a level set {} = {:g} is out of range; it must be above 0", name, shape, value));
}

Box3d box_around(const Vec3d& center, const Vec3d& half) { return {center - half, center + half}; }

}  // namespace

LevelSetPtr level_set_sphere(double radius, const Vec3d& center, const LevelSetOptions& options)
{
    require_length("sphere", "radius", radius);
    return make_level_set({fmt::format("a level set sphere of radius {:g} m", radius),
                           [=](const Vec3d& P) { return (P - center).norm() - radius; },
                           box_around(center, Vec3d::Constant(radius)), 4 * pi * radius * radius, 2 * radius},
                          options);
}

LevelSetPtr level_set_box(const Vec3d& size, const Vec3d& center, const LevelSetOptions& options)
{
    for (int axis = 0; axis < 3; ++axis) require_length("box", "size", size[axis]);
    const Vec3d half = size / 2;
    const auto distance = [=](const Vec3d& P) {
        const Vec3d beyond = (P - center).cwiseAbs() - half;
        return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
    };
    const double area = 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
    return make_level_set({fmt::format("a level set box of {:g} x {:g} x {:g} m", size.x(), size.y(), size.z()),
                           distance, box_around(center, half), area, size.minCoeff()},
                          options);
}

LevelSetPtr level_set_torus(double radius, double tube, const Vec3d& center, const LevelSetOptions& options)
{
    require_length("torus", "radius", radius);
    require_length("torus", "tube", tube);
    if (tube >= radius)
        throw Error(fmt::format("tube of a level set torus = {:g} is out of range; it must be below its radius, {:g}",
                                tube, radius));
    const auto distance = [=](const Vec3d& P) {
        const Vec3d d = P - center;
        return std::hypot(std::hypot(d.x(), d.z()) - radius, d.y()) - tube;
    };
    return make_level_set(
        {fmt::format("a level set torus of radius {:g} m and tube {:g} m", radius, tube), distance,
         box_around(center, {radius + tube, tube, radius + tube}), 4 * pi * pi * radius * tube, 2 * tube},
        options);
}

}  // namespace rapid

// Builds level sets from meshes and warns about meshes that make unreliable ones.
#include "runtime/shapes/level_set/level_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/level_set/mesh_blocks.h"
#include "runtime/shapes/level_set/voxel_blocks.h"
#include "runtime/shapes/mesh/open_mesh.h"

namespace rapid {

// Built-in level sets, evaluated from distance formulas: exact at every voxel of the band.

namespace {

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

void require_size(const char* shape, const char* name, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw Error(fmt::format("{} of a level set {} = {:g} is out of range; it must be above 0", name, shape, value));
}

Box3d box_around(const Vec3d& center, const Vec3d& half) { return {center - half, center + half}; }

}  // namespace

LevelSetPtr level_set_sphere(double radius, const Vec3d& center, const LevelSetOptions& options)
{
    require_size("sphere", "radius", radius);
    return make_level_set(
        {fmt::format("a level set sphere of radius {:g} m", radius),
         [=](const Vec3d& P) { return (P - center).norm() - radius; }, box_around(center, Vec3d::Constant(radius)),
         4 * std::numbers::pi * radius * radius, 2 * radius},
        options);
}

LevelSetPtr level_set_box(const Vec3d& size, const Vec3d& center, const LevelSetOptions& options)
{
    for (int axis = 0; axis < 3; ++axis) require_size("box", "size", size[axis]);
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
    require_size("torus", "radius", radius);
    require_size("torus", "tube", tube);
    if (tube >= radius)
        throw Error(fmt::format("tube of a level set torus = {:g} is out of range; it must be below its radius, {:g}",
                                tube, radius));
    const auto distance = [=](const Vec3d& P) {
        const Vec3d d = P - center;
        return std::hypot(std::hypot(d.x(), d.z()) - radius, d.y()) - tube;
    };
    return make_level_set({fmt::format("a level set torus of radius {:g} m and tube {:g} m", radius, tube), distance,
                           box_around(center, {radius + tube, tube, radius + tube}),
                           4 * std::numbers::pi * std::numbers::pi * radius * tube, 2 * tube},
                          options);
}

namespace {

// There are two routes. A narrow band of a closed mesh whose pieces do not overlap is measured by blocks and baked from
// them: three voxels took 71 ms where OpenVDB's distances with corrections took 145, and resolving OpenVDB's symbols
// would take another 35. Everything else needs an OpenVDB grid: searches and signs that propagate between voxels, and
// bands so wide that testing each triangle takes longer (twice as long at 50 voxels).
std::shared_ptr<const BakedLevelSet> build(const MeshPtr& mesh, bool balanced, const LevelSetOptions& options)
{
    const Box3d bounds = mesh->bounds().cast<double>();
    constexpr double far = 2147483648.0;  // voxels; up to here integers are exact and OpenVDB's maps invertible
    if (const double farthest = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff();
        !(farthest <= far * options.voxel))
        throw Error(
            fmt::format("mesh \"{}\" reaches {:g} m from the origin, more than 2^31 voxels of {:g} m; move it nearer "
                        "to the origin, and move the level set back",
                        mesh->name, farthest, options.voxel));
    require_buildable(fmt::format("mesh \"{}\"", mesh->name), mesh->area(), bounds, options);
    const VoxelFrame frame = frame_around(bounds, options.voxel);
    const double half_width = options.half_width * options.voxel;
    const auto rebuild = [mesh, balanced, voxel = options.voxel](double wide) {
        return build(mesh, balanced, {voxel, wide / voxel});
    };
    std::optional<MeshBlocks> measured;
    if (balanced && half_width <= MeshBlocks::widest * frame.voxel) measured = measure(*mesh, frame, half_width);
    if (measured && !measured->overlap) {
        const auto grid = [=] { return grid_of_blocks(measure(*mesh, frame, half_width).blocks); };
        return std::make_shared<BakedLevelSet>(bake(measured->blocks), measured->blocks.voxels_in_band(),
                                               BakedLevelSet::Source{grid, rebuild});
    }
    return level_set_of_grid(grid_of_mesh(*mesh, balanced, frame, half_width, measured ? &*measured : nullptr),
                             rebuild);
}

// Returns the bounds of the connected parts of a mesh.
std::vector<Box3f> pieces_of(const Mesh& mesh)
{
    std::vector<std::int32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::int32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (const Mesh::Triangle& t : mesh.triangles) {
        parent[root(t[1])] = root(t[0]);
        parent[root(t[2])] = root(t[0]);
    }
    std::vector<Box3f> bounds(mesh.positions.size());
    for (const Mesh::Triangle& t : mesh.triangles)
        for (const std::int32_t i : t) bounds[root(i)].extend(mesh.positions[i]);
    std::erase_if(bounds, [](const Box3f& box) { return box.isEmpty(); });
    return bounds;
}

// Warns about a mesh that is questionable but usable.
void warn(const Mesh& mesh, const Mesh::Openness& open, const LevelSetOptions& options,
          std::vector<std::string>& warnings)
{
    if (open.unbalanced_edges > 0)
        warnings.push_back(fmt::format(
            "mesh \"{}\" is not closed: {} edges have one face, and {} have more than two or two that face different "
            "ways; holes smaller than a voxel ({:g} m) are closed; with larger ones the inside counts as outside",
            mesh.name, open.boundary_edges, open.non_manifold_edges, options.voxel));
    else if (const double volume = mesh.signed_volume(); volume < 0)
        warnings.push_back(
            fmt::format("mesh \"{}\" is inside out: its volume is {:.4g} m³; its faces are assumed to point outwards",
                        mesh.name, volume));
    const std::vector<Box3f> pieces = pieces_of(mesh);
    const auto thin = std::count_if(pieces.begin(), pieces.end(),
                                    [&](const Box3f& bounds) { return bounds.sizes().minCoeff() < options.voxel; });
    if (thin > 0)
        warnings.push_back(
            fmt::format("{} of the {} pieces of mesh \"{}\" are thinner than a voxel ({:g} m) and may be missing; use "
                        "a smaller voxel",
                        thin, pieces.size(), mesh.name, options.voxel));
    Box3f bounds;
    for (const Box3f& piece : pieces) bounds.extend(piece);
    if (const double size = bounds.isEmpty() ? 0 : bounds.sizes().maxCoeff();
        2 * options.voxel >= size * (1 - 1e-6) && size > 0)  // sizes are floats
        warnings.push_back(fmt::format(
            "a voxel of {:g} m is at least half as large as mesh \"{}\", which is {:g} m long; use a voxel of {:.1g} m",
            options.voxel, mesh.name, size, size / 30));
}

}  // namespace

LevelSetPtr level_set_of_same_faces(const MeshPtr& mesh, const LevelSetOptions& options, const Mesh::Openness& open)
{
    const bool balanced = open.unbalanced_edges == 0;
    const auto level_set = build(mesh, balanced, options);
    if (!level_set->has_surface()) {
        if (!balanced)
            throw Error(
                fmt::format("mesh \"{}\" has no inside with voxel = {:g} m, because {} of its edges have one face; {}",
                            mesh->name, options.voxel, open.boundary_edges, open_mesh_remedy));
        const Vec3f size = mesh->bounds().sizes();
        if (size.minCoeff() == 0)
            throw Error(
                fmt::format("mesh \"{}\" is flat: its size is {:g} x {:g} x {:g} m; a level set needs an inside",
                            mesh->name, size.x(), size.y(), size.z()));
        throw Error(
            fmt::format("mesh \"{}\" vanishes with voxel = {:g} m: its size is {:g} x {:g} x {:g} m; use a voxel "
                        "of at most {:.3g} m",
                        mesh->name, options.voxel, size.x(), size.y(), size.z(), size.minCoeff() / 3));
    }
    return level_set;
}

LevelSetPtr level_set_from_mesh(const MeshPtr& mesh, const LevelSetOptions& options, std::vector<std::string>& warnings)
{
    require_legal(options);
    if (mesh->triangles.empty())
        throw Error(fmt::format("mesh \"{}\" has no faces; a level set needs a closed surface", mesh->name));
    const Mesh::Openness open = mesh->openness();
    LevelSetPtr level_set = level_set_of_same_faces(mesh, options, open);
    warn(*mesh, open, options, warnings);
    return level_set;
}

void require_legal(const LevelSetOptions& options)
{
    if (!(options.voxel > 0) || !std::isfinite(options.voxel))
        throw Error(fmt::format("voxel = {:g} m is out of range; it must be above 0", options.voxel));
    // The gradient at the surface needs the values of the adjacent cells on both sides.
    if (!(options.half_width >= 2) || !std::isfinite(options.half_width))
        throw Error(fmt::format("half_width = {:g} voxels is out of range; it must be at least 2", options.half_width));
}

void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options)
{
    constexpr double most = 2147483648.0;  // 2^31
    // Covers the blocks during the build and the baked copy: 30 to 60 bytes per voxel of a smooth surface at half
    // widths of 3 to 10, where a third to two thirds of a leaf is in the band.
    constexpr double bytes_per_voxel = 64;

    // Far from the surface leaves are full.
    constexpr double bytes_per_voxel_around = 16;

    // Covers the index and, while it is built, the index of the measured blocks and the flags of blocks with values.
    constexpr double bytes_per_block = 2 * sizeof(std::int32_t) + 1;

    // For a convex body the volume of the outer band is area h + M h² + 4/3 pi h³ (Steiner's formula). M is at most
    // that of the bounds, pi times the sum of their edges.
    const double h = options.half_width;  // voxels
    const Vec3d size = bounds.sizes() / options.voxel, across = size + Vec3d::Constant(2 * h);
    const double in_band = area / (options.voxel * options.voxel) * 2 * h;
    const double around = M_PI * size.sum() * h * h + 4.0 / 3 * M_PI * h * h * h;
    const double near = std::min(in_band, across.prod()), voxels = std::min(near + around, across.prod());
    const double indexed = (across / BakedGrid::block + Vec3d::Constant(2)).prod();
    const double bytes = near * bytes_per_voxel + (voxels - near) * bytes_per_voxel_around + indexed * bytes_per_block;

    // The larger voxel at which the band (which shrinks with its square) and the index (with its cube) fit.
    const auto larger = [&](double band_excess, double index_excess) {
        return 1.02 * options.voxel * std::max({1.0, std::sqrt(band_excess), std::cbrt(index_excess)});
    };
    if (voxels > most || indexed > most)
        throw Error(
            fmt::format("{} with voxel = {:g} m would make about {:.3g} voxels and an index of {:.3g} blocks, but at "
                        "most 2147483648 of each are possible; use a voxel of at least {:.3g} m",
                        what, options.voxel, voxels, indexed, larger(voxels / most, indexed / most)));
    if (fits_in_memory(bytes)) return;
    const double memory = static_cast<double>(memory_budget());
    throw memory_exceeded(fmt::format("{} with voxel = {:g} m", what, options.voxel), bytes,
                          fmt::format("use a voxel of at least {:.3g} m", larger(bytes / memory, bytes / memory)));
}

}  // namespace rapid

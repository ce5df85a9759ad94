// Built-in level sets, from formulas of their distance: exact at every voxel of the band.
#include <fmt/format.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "runtime/error.h"
#include "runtime/shapes/level_set/level_set_grid.h"

namespace rapid {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using Leaf = FloatGrid::TreeType::LeafNodeType;

constexpr double pi = std::numbers::pi;

// A surface with a distance that is exact, or at least has a slope of 1 at most.
struct Formula {
    std::string what;  // `a level set sphere of radius 2`
    std::function<double(const Vec3d& P)> distance;
    Box3d bounds;
    double area;       // m²
    double thickness;  // m, of its thinnest part
};

// The leaves that the band may touch: an octree down to the size of a leaf, without the cubes whose centre is farther
// from the surface than the band and their half diagonal.
void find_leaves(const Formula& formula, const openvdb::math::Transform& transform, double half_width,
                 const Coord& origin, int size, std::vector<Coord>& found)
{
    const double voxel = transform.voxelSize()[0], half = 0.5 * size;
    const auto c = transform.indexToWorld(openvdb::Vec3d(origin.x() + half, origin.y() + half, origin.z() + half));
    if (std::abs(formula.distance({c[0], c[1], c[2]})) > half_width + std::numbers::sqrt3 * half * voxel) return;
    if (size == Leaf::DIM) {
        found.push_back(origin);
        return;
    }
    const int h = size / 2;
    for (int n = 0; n < 8; ++n)
        find_leaves(formula, transform, half_width, origin.offsetBy((n & 4 ? h : 0), (n & 2 ? h : 0), (n & 1 ? h : 0)),
                    h, found);
}

// Null where no voxel of the leaf is in the band.
std::unique_ptr<Leaf> fill_leaf(const Formula& formula, const openvdb::math::Transform& transform, float half_width,
                                const Coord& origin)
{
    auto leaf = std::make_unique<Leaf>(origin, half_width);
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
        const auto P = transform.indexToWorld(leaf->offsetToGlobalCoord(n));
        const float phi = static_cast<float>(formula.distance({P[0], P[1], P[2]}));
        if (std::abs(phi) < half_width)
            leaf->setValueOn(n, phi);
        else
            leaf->setValueOff(n, std::copysign(half_width, phi));
    }
    return leaf->isEmpty() ? nullptr : std::move(leaf);
}

FloatGrid::Ptr build(const Formula& formula, const LevelSetOptions& options)
{
    require_buildable(formula.what, formula.area, formula.bounds, options);
    initialize_openvdb();
    const auto transform = make_transform(options.voxel, formula.bounds);
    const double half_width = options.half_width * options.voxel;

    const Box3d band(formula.bounds.min().array() - half_width, formula.bounds.max().array() + half_width);
    const auto low = transform->worldToIndexNodeCentered({band.min().x(), band.min().y(), band.min().z()});
    const auto high = transform->worldToIndexNodeCentered({band.max().x(), band.max().y(), band.max().z()});
    const Coord origin = low.offsetBy(-1) & ~(Leaf::DIM - 1);
    const Coord across = high - origin;
    int size = Leaf::DIM;
    while (size <= std::max({across.x(), across.y(), across.z()})) size *= 2;

    std::vector<Coord> origins;
    find_leaves(formula, *transform, half_width, origin, size, origins);
    std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
    tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t i) {
        leaves[i] = fill_leaf(formula, *transform, static_cast<float>(half_width), origins[i]);
    });

    auto grid = FloatGrid::create(static_cast<float>(half_width));
    grid->setTransform(transform);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("surface");
    for (std::unique_ptr<Leaf>& leaf : leaves)
        if (leaf) grid->tree().addLeaf(leaf.release());
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

LevelSetPtr make_level_set(Formula formula, const LevelSetOptions& options)
{
    require_legal(options);
    if (formula.thickness < options.voxel)
        throw Error(fmt::format("{} vanishes with voxel = {:g} m: it is {:g} m thick; use a voxel of at most {:.3g} m",
                                formula.what, options.voxel, formula.thickness, formula.thickness / 2));
    auto grid = build(formula, options);
    const double voxel = options.voxel;
    return std::make_shared<GridLevelSet>(std::move(grid), [formula = std::move(formula), voxel](double half_width) {
        return build(formula, {voxel, half_width / voxel});
    });
}

void require_length(const char* shape, const char* name, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw Error(fmt::format("{} of a level set {} = {:g} is out of range; it must be above 0", name, shape, value));
}

Box3d box_around(const Vec3d& center, const Vec3d& half) { return {center - half, center + half}; }

LevelSetPtr sphere(double radius, const Vec3d& center, const LevelSetOptions& options)
{
    require_length("sphere", "radius", radius);
    return make_level_set({fmt::format("a level set sphere of radius {:g} m", radius),
                           [=](const Vec3d& P) { return (P - center).norm() - radius; },
                           box_around(center, Vec3d::Constant(radius)), 4 * pi * radius * radius, 2 * radius},
                          options);
}

LevelSetPtr box(const Vec3d& size, const Vec3d& center, const LevelSetOptions& options)
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

LevelSetPtr torus(double radius, double tube, const Vec3d& center, const LevelSetOptions& options)
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

RAPID_DEFINE(level_set_sphere, sphere);
RAPID_DEFINE(level_set_box, box);
RAPID_DEFINE(level_set_torus, torus);

}  // namespace
}  // namespace rapid

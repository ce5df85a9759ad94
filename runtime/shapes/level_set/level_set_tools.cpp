#include "runtime/shapes/level_set/level_set_tools.h"

#include <fmt/format.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/placed.h"

namespace rapid {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using Leaf = FloatGrid::TreeType::LeafNodeType;

// Voxel sizes with a smaller relative difference are equal up to rounding.
constexpr double same_size = 1e-6;
// Voxels whose offset is below this fraction of a voxel coincide.
constexpr double same_position = 1e-4;

// Returns a level set with axis-aligned voxels. A rotated level set is resampled.
BakedPtr on_axes(const LevelSetPtr& shape)
{
    if (auto grid = std::dynamic_pointer_cast<const BakedLevelSet>(shape)) return grid;
    return std::dynamic_pointer_cast<const BakedLevelSet>(resample_level_set(shape, shape->voxel()));
}

LevelSetPtr finished(FloatGrid::Ptr grid, RebuildGrid rebuild, const std::string& what)
{
    grid->setName("surface");
    auto result = level_set_of(std::move(grid), std::move(rebuild));
    if (!result->has_surface()) throw Error(fmt::format("nothing is left of {}", what));
    return result;
}

// Returns a copy with values `scale` (phi - shift), in a band of `half_width` metres of the new values, with voxels
// displaced by `by`. The band of `grid` must be wide enough.
FloatGrid::Ptr rebanded(const FloatGrid& grid, const openvdb::math::Transform& transform, double scale, double shift,
                        double half_width, const Coord& by = Coord(0))
{
    std::vector<const Leaf*> leaves;
    grid.tree().getNodes(leaves);
    const auto width = static_cast<float>(half_width);
    // Leaves begin at multiples of 8. If the displacement is not a multiple, a leaf of `grid` is split across several.
    auto result = FloatGrid::create(width);
    result->setTransform(transform.copy());
    result->setGridClass(openvdb::GRID_LEVEL_SET);
    const auto moved = [&](float phi) { return static_cast<float>(scale * (double(phi) - shift)); };
    if (by.x() % Leaf::DIM != 0 || by.y() % Leaf::DIM != 0 || by.z() % Leaf::DIM != 0) {
        auto accessor = result->getAccessor();
        for (const Leaf* leaf : leaves)
            for (auto value = leaf->cbeginValueOn(); value; ++value)
                if (const float phi = moved(*value); std::abs(phi) < width)
                    accessor.setValueOn(value.getCoord() + by, phi);
    } else {
        std::vector<std::unique_ptr<Leaf>> made(leaves.size());
        tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
            auto leaf = std::make_unique<Leaf>(leaves[i]->origin() + by, width);
            for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
                const float phi = moved(leaves[i]->getValue(n));
                if (std::abs(phi) < width && leaves[i]->isValueOn(n))
                    leaf->setValueOn(n, phi);
                else
                    leaf->setValueOff(n, std::copysign(width, phi));
            }
            if (!leaf->isEmpty()) made[i] = std::move(leaf);
        });
        for (auto& leaf : made)
            if (leaf) result->tree().addLeaf(leaf.release());
    }
    openvdb::tools::signedFloodFill(result->tree());
    return result;
}

FloatGrid::Ptr rebanded(const FloatGrid& grid, double shift, double half_width)
{
    return rebanded(grid, grid.transform(), 1, shift, half_width);
}

// Returns the level set on the voxels of `like`, with a band of exactly `half_width` metres.
FloatGrid::Ptr aligned(const LevelSetPtr& shape, const FloatGrid& like, double half_width)
{
    const BakedPtr grid = std::dynamic_pointer_cast<const BakedLevelSet>(shape);
    const double voxel = like.voxelSize()[0];
    if (!grid || std::abs(grid->voxel() - voxel) > same_size * voxel)
        return resampled_to(shape, like.transform(), half_width);
    const openvdb::Vec3d position = like.worldToIndex(grid_of(*grid).indexToWorld(Coord(0)));
    const Coord whole = Coord::round(position);
    const openvdb::Vec3d off = position - whole.asVec3d();
    if (std::max({std::abs(off[0]), std::abs(off[1]), std::abs(off[2])}) > same_position)
        return resampled_to(shape, like.transform(), half_width);
    const auto wide = std::static_pointer_cast<const BakedLevelSet>(grid->with_band(half_width));
    return rebanded(grid_of(*wide), like.transform(), 1, 0, half_width, whole);
}

FloatGrid::Ptr combine(const BakedPtr& a, const LevelSetPtr& b, Combine how, double half_width)
{
    const auto wide = std::static_pointer_cast<const BakedLevelSet>(a->with_band(half_width));
    const FloatGrid::Ptr first = rebanded(grid_of(*wide), 0, half_width), second = aligned(b, *first, half_width);
    switch (how) {
        case Combine::Union:
            return openvdb::tools::csgUnionCopy(*first, *second);
        case Combine::Intersect:
            return openvdb::tools::csgIntersectionCopy(*first, *second);
        case Combine::Subtract:
            break;
    }
    return openvdb::tools::csgDifferenceCopy(*first, *second);
}

LevelSetPtr combined(const LevelSetPtr& a, const LevelSetPtr& b, Combine how, std::vector<std::string>& warnings)
{
    if (std::abs(a->voxel() - b->voxel()) > same_size * a->voxel())
        warnings.push_back(
            fmt::format("the second level set has a voxel of {:g} m and the first of {:g} m; the second is resampled "
                        "(use :resample to choose the voxel)",
                        b->voxel(), a->voxel()));
    const BakedPtr first = on_axes(a);
    const auto build = [=](double half_width) { return combine(first, b, how, half_width); };
    const char* what = how == Combine::Union       ? "the union"
                       : how == Combine::Intersect ? "the intersection; the two do not overlap"
                                                   : "the difference; the second covers the first";
    return finished(build(first->band()), build, what);
}

LevelSetPtr offset(const LevelSetPtr& shape, double metres)
{
    if (!std::isfinite(metres)) throw Error(fmt::format("an offset of {} m; it must be finite", metres));
    const std::string what =
        fmt::format("the level set {:g} m inwards; its size is {:.3g} x {:.3g} x {:.3g} m", -metres,
                    shape->bounds().sizes().x(), shape->bounds().sizes().y(), shape->bounds().sizes().z());
    if (-metres > shape->bounds().sizes().minCoeff() / 2) throw Error(fmt::format("nothing is left of {}", what));
    const BakedPtr grid = on_axes(shape);
    const auto build = [=](double half_width) {
        const double reach = half_width + std::abs(metres) + grid->voxel();
        return rebanded(grid_of(*std::static_pointer_cast<const BakedLevelSet>(grid->with_band(reach))), metres,
                        half_width);
    };
    return finished(build(grid->band()), build, what);
}

LevelSetPtr smoothed(const LevelSetPtr& shape, int width, int iterations)
{
    const BakedPtr source = on_axes(shape);
    const FloatGrid::Ptr grid = grid_of(*source).deepCopy();
    openvdb::tools::LevelSetFilter<FloatGrid> filter(*grid);
    for (int i = 0; i < iterations; ++i) filter.gaussian(width);
    return finished(
        grid, [grid](double half_width) { return widened(*grid, half_width); },
        fmt::format("the level set smoothed {} times by {} voxels", iterations, width));
}

LevelSetPtr moved(const LevelSetPtr& shape, const Pose& pose)
{
    if (const auto turned = std::dynamic_pointer_cast<const PlacedLevelSet>(shape))
        return std::make_shared<PlacedLevelSet>(turned->rest(), pose * turned->pose());
    if (!pose.rotation.vec().isZero(0)) return std::make_shared<PlacedLevelSet>(shape, pose);
    const BakedPtr grid = std::dynamic_pointer_cast<const BakedLevelSet>(shape);
    if (const double voxel = pose.scale * grid->voxel(); !(voxel >= min_voxel))
        throw Error(fmt::format("the scaled level set would have voxels of {:g} m; they must be at least {:g} m", voxel,
                                min_voxel));
    auto transform = grid_of(*grid).transform().copy();
    transform->postScale(pose.scale);
    transform->postTranslate({pose.translation.x(), pose.translation.y(), pose.translation.z()});
    const auto build = [=](double half_width) {
        const auto wide = std::static_pointer_cast<const BakedLevelSet>(grid->with_band(half_width / pose.scale));
        return rebanded(grid_of(*wide), *transform, pose.scale, 0, half_width);
    };
    return finished(build(pose.scale * grid->band()), build, "the moved level set");
}

RAPID_DEFINE(combine_level_sets, combined);
RAPID_DEFINE(offset_level_set, offset);
RAPID_DEFINE(smooth_level_set, smoothed);
RAPID_DEFINE(move_level_set, moved);

}  // namespace

// Level sets from points: the union of their balls, exact outside.

namespace {

using openvdb::FloatGrid;

// A list of points in the form that OpenVDB requires.
struct Balls {
    using PosType = openvdb::Vec3R;

    std::vector<Vec3f> P;
    std::vector<float> radius;  // one for all, or shape [P]

    float radius_of(std::size_t i) const { return radius[radius.size() == 1 ? 0 : i]; }
    std::size_t size() const { return P.size(); }
    void getPos(std::size_t i, PosType& X) const { X = PosType(P[i].x(), P[i].y(), P[i].z()); }
    void getPosRad(std::size_t i, PosType& X, openvdb::Real& r) const
    {
        getPos(i, X);
        r = radius_of(i);
    }
};

LevelSetPtr from_points(std::span<const Vec3f> P, std::span<const float> radius, const LevelSetOptions& options)
{
    constexpr double least = 1.5;  // voxels; a smaller ball may contain no voxel centre
    require_legal(options);
    if (P.empty()) throw Error("a level set needs points, and there are none");
    initialize_openvdb();
    auto balls = std::make_shared<Balls>();
    balls->P.assign(P.begin(), P.end());
    balls->radius.assign(radius.begin(), radius.end());

    Box3d bounds;
    double area = 0;
    for (std::size_t i = 0; i < balls->size(); ++i) {
        const double r = balls->radius_of(i);
        if (!(r >= least * options.voxel) || !std::isfinite(r))
            throw Error(
                fmt::format("point {} has the radius {:g} m; with voxel = {:g} m it must be at least {:g} voxels; use "
                            "a voxel of at most {:.3g} m",
                            i, r, options.voxel, least, std::max(r, 0.0) / least));
        if (!P[i].allFinite())
            throw Error(
                fmt::format("point {} is at ({}, {}, {}); positions must be finite", i, P[i].x(), P[i].y(), P[i].z()));
        bounds.extend(Vec3d(P[i].cast<double>() - Vec3d::Constant(r)));
        bounds.extend(Vec3d(P[i].cast<double>() + Vec3d::Constant(r)));
        area += 4 * std::numbers::pi * r * r;
    }
    const double voxel = options.voxel;
    const auto build = [=](double half_width) {
        require_buildable(fmt::format("a level set of {} points", balls->size()), area, bounds,
                          {voxel, half_width / voxel});
        auto grid = FloatGrid::create(static_cast<float>(half_width));
        grid->setTransform(transform_of(frame_around(bounds, voxel)));
        grid->setGridClass(openvdb::GRID_LEVEL_SET);
        grid->setName("surface");
        openvdb::tools::ParticlesToLevelSet<FloatGrid> rasterizer(*grid);
        rasterizer.rasterizeSpheres(*balls);
        // The part of finalize() that matters without attributes. Calling finalize() would compile the attribute code
        // too, which takes a third longer.
        openvdb::tools::pruneLevelSet(grid->tree());
        return grid;
    };
    return level_set_of(build(options.half_width * voxel), build);
}

RAPID_DEFINE(level_set_from_points, from_points);

}  // namespace

}  // namespace rapid

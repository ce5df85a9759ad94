// Level sets from points: the union of their balls, exact outside.
#include <fmt/format.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/Prune.h>

#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/buildable.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/level_set_tools.h"

namespace rapid {
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

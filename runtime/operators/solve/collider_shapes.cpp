#include "runtime/operators/solve/collider_shapes.h"

#include <fmt/format.h>

#include <cmath>

#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/solver/collision_radii.h"
#include "runtime/stopwatch.h"

namespace rapid {
namespace {

// Voxels of a level set; and of one whose band is wider than the shape itself, which takes some 4 s to fill and 1.5 GiB
// to hold: points that large are kept out without voxels that small.
constexpr double most_voxels = 0x1p31, most_voxels_of_wide_band = 0x1p27;

double largest_radius(const Collider& collider, const Dynamics& dynamics, const PointSet& points)
{
    const CollisionRadii radii(dynamics, points);
    const Strided<float> radius = radii.of(collider);
    float largest = 0;
    for (std::size_t i = 0; i < (radius.stride ? points.size() : 1); ++i) largest = std::max(largest, radius[i]);
    return largest;
}

// The distance from the surface at which a level set is sampled (§4.3), m: the largest radius and two voxels, for the
// cells at the edge of the band; and the depth that a sub-step reaches, where points are put back after it.
double needed_band(const Collider& collider, const Dynamics& dynamics, const PointSet& points, double voxel,
                   const Box3d& bounds, double h, int substeps)
{
    // A grid keeps its half width in single precision.
    const double needed = (largest_radius(collider, dynamics, points) + 2 * voxel) * (1 - 0x1p-20);
    if (collider.method == Method::Continuous) return needed;
    float fastest2 = 0;
    const Strided<Vec3f> v = points.v().read();
    for (std::size_t i = 0; i < points.size(); ++i) fastest2 = std::max(fastest2, v[i].squaredNorm());
    // By factors of two, so that points that gather speed do not have it rebuilt in every frame.
    const double path = std::sqrt(fastest2) * h / substeps;
    double deep = voxel;
    while (deep < path) deep *= 2;
    return needed + std::min(deep, 0.5 * bounds.sizes().minCoeff());
}

LevelSetPtr widened_to(const LevelSetPtr& shape, double needed, const Collider& collider)
{
    // The voxels of the shell around the bounding box.
    const Eigen::Array3d size = shape->bounds().sizes().array() / shape->voxel();
    const double band = needed / shape->voxel();
    const double voxels = (size + 2 * band).prod() - (size - 2 * band).max(0).prod();
    const double most = band > size.maxCoeff() ? most_voxels_of_wide_band : most_voxels;
    if (voxels > most)
        throw Error(fmt::format("points with a radius of {:.4g} m need a band of {:.0f} voxels of {:g} m around its "
                                "level set, some {:.1e} in all; at most {:.1e} fit: give it a larger voxel",
                                needed - 2 * shape->voxel(), band, shape->voxel(), voxels, most))
            .in_node(collider.node)
            .at(collider.location);
    return shape->with_band(needed);
}

void warn_of_jump(const Collider& collider, const Jump& jump, double frame, const Evaluation& now)
{
    const auto number = static_cast<std::int64_t>(std::ceil(frame));
    now.warnings.push_back(
        fmt::format("{}:{}: node \"{}\": the shape {}; nothing is swept along on the way (cut = {{{}}} says so, cut = "
                    "{{}} that it is no jump)",
                    collider.location.file, collider.location.line, collider.node, describe(jump, number), number));
}

}  // namespace

void ColliderShapes::prepare(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                             const Evaluation& now)
{
    widen(dynamics, points, substeps, now);
    set_in_motion(dynamics, points, clock, substeps, now);
}

void ColliderShapes::widen(Dynamics& dynamics, const PointSet& points, int substeps, const Evaluation& now)
{
    std::map<ShapePtr, Widened> widened;
    std::map<std::string, Band> bands;
    for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
        const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
        if (const auto blended = std::dynamic_pointer_cast<const BlendedLevelSets>(collider->shape)) {
            const double needed =
                needed_band(*collider, dynamics, points, blended->voxel(), blended->bounds(), now.frame.dt, substeps);
            const Stopwatch stopwatch;
            auto replacement = std::make_shared<Collider>(*collider);
            const auto wide = blended->with_band(needed);
            now.figures.bands.push_back({collider->node, wide->band(), wide->active_voxels(), stopwatch.seconds()});
            replacement->shape = wide;
            dynamics.replace_collider(i, std::move(replacement));
            continue;
        }
        const auto level_set = std::dynamic_pointer_cast<const LevelSet>(collider->shape);
        if (!level_set) continue;
        const double needed =
            needed_band(*collider, dynamics, points, level_set->voxel(), level_set->bounds(), now.frame.dt, substeps);
        const Stopwatch stopwatch;
        Widened made = known(*collider, level_set);
        if (const auto other = widened.find(collider->shape);
            other != widened.end() && other->second.shape->band() >= needed)
            made = other->second;
        const bool builds = made.shape->band() < needed;
        if (builds) made = {widened_to(made.shape, needed, *collider), needed};
        const LevelSetPtr shape = made.shape;
        widened[collider->shape] = made;
        now.figures.bands.push_back(
            {collider->node, shape->band(), shape->active_voxels(), builds ? stopwatch.seconds() : 0});
        if (shape == level_set) continue;
        bands[collider->node] = {made.band, level_set->voxel(), level_set->bounds().min(), level_set->bounds().max(),
                                 level_set->active_voxels()};
        auto replacement = std::make_shared<Collider>(*collider);
        replacement->shape = shape;
        dynamics.replace_collider(i, std::move(replacement));
    }
    widened_ = std::move(widened);
    bands_ = std::move(bands);
    restored_.clear();
}

bool ColliderShapes::Band::is_of(const LevelSet& shape) const
{
    return voxel == shape.voxel() && min == shape.bounds().min() && max == shape.bounds().max() &&
           voxels == shape.active_voxels();
}

// As the step before has left it.
ColliderShapes::Widened ColliderShapes::known(const Collider& collider, const LevelSetPtr& shape) const
{
    if (const auto found = widened_.find(collider.shape); found != widened_.end()) return found->second;
    const auto found = restored_.find(collider.node);
    if (found == restored_.end() || !found->second.is_of(*shape)) return {shape, 0};
    return {widened_to(shape, found->second.band, collider), found->second.band};
}

void ColliderShapes::set_in_motion(Dynamics& dynamics, const PointSet& points, const FrameClock& clock, int substeps,
                                   const Evaluation& now)
{
    const std::int64_t step = clock.step_at(now.frame);
    const double to = now.frame.number, from = clock.at_step(step - 1).number;
    std::map<std::string, Deformation> deformations;
    const auto deformed = [&](const Collider& collider, const PathOptions& options,
                              std::optional<Jump>& jump) -> ShapePtr {
        const auto known = deformations_.find(collider.node);
        const bool same = known != deformations_.end() && known->second.is_of(collider.deforming);
        Deformation& body =
            deformations.emplace(collider.node, same ? known->second : Deformation(collider.deforming)).first->second;
        body.set_body(collider.deforming);
        const double band = needed_band(collider, dynamics, points, collider.deforming->voxel(),
                                        collider.deforming->bounds(), now.frame.dt, substeps);
        const Stopwatch stopwatch;
        Deformation::Interval interval = body.over({clock.fps, clock.start}, from, to, collider.motion, options, band);
        const LevelSet& built = *body.at_end();
        now.figures.bands.push_back({collider.node, built.band(), built.active_voxels(), stopwatch.seconds()});
        jump = interval.jump;
        return interval.shape;
    };

    for (std::size_t i = 0; i < dynamics.colliders().size(); ++i) {
        const std::shared_ptr<const Collider> collider = dynamics.colliders()[i];
        if (!collider->motion && !collider->deforming) continue;
        auto in_motion = std::make_shared<Collider>(*collider);
        PathOptions options;
        options.cuts = collider->cuts;
        std::optional<Jump> jump;
        try {
            if (collider->deforming) {
                in_motion->shape = deformed(*collider, options, jump);
            } else {
                const AnimatedShape body(collider->shape, collider->motion);
                MovingStep moved = moving_in_step(body, clock, step, options);
                in_motion->shape = std::move(moved.shape);
                jump = moved.jump;
            }
        } catch (Error& error) {
            error.in_node(collider->node).at(collider->location);
            throw;
        }
        if (jump) warn_of_jump(*collider, *jump, to, now);
        in_motion->motion = nullptr;
        in_motion->deforming = nullptr;
        dynamics.replace_collider(i, std::move(in_motion));
    }
    deformations_ = std::move(deformations);
}

}  // namespace rapid

#include "runtime/shapes/motion/deforming.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/deforming_shape.h"

namespace rapid {
namespace {

MeshPtr mesh_of(const Mesh& rest, std::span<const Cubic<Vec3d>> curves, double t)
{
    auto mesh = std::make_shared<Mesh>();
    mesh->name = rest.name;
    mesh->triangles = rest.triangles;
    mesh->positions.reserve(curves.size());
    for (const Cubic<Vec3d>& curve : curves) mesh->positions.push_back(curve.at(t).cast<float>());
    return mesh;
}

}  // namespace

DeformingLevelSet::DeformingLevelSet(std::shared_ptr<const AnimatedMesh> mesh, const LevelSetOptions& options,
                                     std::vector<std::string>& warnings)
    : mesh_(std::move(mesh)), options_(options), open_(mesh_->rest()->openness()), tree_(triangle_tree(mesh_->rest()))
{
    bounds_ = level_set_from_mesh(mesh_->rest(), options, warnings)->bounds();
}

DeformingLevelSetPtr DeformingLevelSet::transformed(const MotionPtr& motion) const
{
    auto moved = std::make_shared<DeformingLevelSet>(*this);
    moved->mesh_ = mesh_->transformed(motion);
    moved->built_ = std::make_shared<Built>();
    return moved;
}

LevelSetPtr DeformingLevelSet::at(const FrameClock& clock, std::int64_t frame, double band) const
{
    const FrameRange range = mesh_->range();
    if (!range.empty()) frame = std::llround(std::clamp(static_cast<double>(frame), range.first, range.last));
    const std::lock_guard lock(built_->mutex);
    auto& by_frame = built_->by_frame;
    std::erase_if(by_frame, [](const auto& entry) { return entry.second.expired(); });
    const bool by_clock = mesh_->depends_on_clock();
    std::weak_ptr<const LevelSet>& known = by_frame[{by_clock ? clock.fps : 0, by_clock ? clock.start : 0, frame}];
    LevelSetPtr level_set = known.lock();
    if (!level_set || !(level_set->band() >= band)) known = level_set = build(mesh_->at(clock, frame), band);
    return level_set;
}

LevelSetPtr DeformingLevelSet::of(const MeshOfFrame& mesh) const
{
    const auto same = std::static_pointer_cast<const BakedLevelSet>(at({}, mesh.frame(), 0));
    return std::make_shared<BakedLevelSet>(same, shared_from_this());
}

LevelSetPtr DeformingLevelSet::build(const MeshPtr& mesh, double band) const
{
    LevelSetOptions options = options_;
    options.half_width = std::max(options.half_width, band / options.voxel * (1 + 1e-6));
    return level_set_of_same_faces(mesh, options, open_);
}

LevelSetPtr Deformation::build(const MeshPtr& mesh, double band)
{
    band_ = band;
    return body_->build(mesh, band);
}

Deformation::Interval Deformation::over(const FrameClock& clock, double from, double to, const MotionPtr& motion,
                                        const PathOptions& options, double band)
{
    const std::shared_ptr<const AnimatedMesh> moved = motion ? body_->mesh().transformed(motion) : nullptr;
    const AnimatedMesh& mesh = moved ? *moved : body_->mesh();
    const auto frame = static_cast<std::int64_t>(std::ceil(to));
    const FramePath path = path_of(mesh, clock, frame, options);
    const auto at_frame = [&](std::int64_t whole) {
        if (moved) return build(mesh.at(clock, whole), band);
        band_ = band;
        return body_->at(clock, whole, band);
    };
    if (!std::isfinite(band_)) throw Error("an endless band: the snapshot belongs to another graph or is damaged");
    if (!at_end_ && end_ == from) at_end_ = build(mesh.at(clock, static_cast<std::int64_t>(from)), band_);
    if (path.kind == FramePath::Still) {
        if (!(at_end_ && end_ == from && at_end_->band() >= band)) at_end_ = at_frame(frame);
        end_ = to;
        return {at_end_, path.jump};
    }

    std::vector<Cubic<Vec3d>> curves = vertex_curves(mesh, clock, frame, path);
    const double whole = static_cast<double>(frame) - 1;
    for (Cubic<Vec3d>& curve : curves) curve = cubic_part(curve, from - whole, to - whole);
    const bool jumped = path.kind == FramePath::AfterCut && from == whole;
    LevelSetPtr begin;
    if (!jumped) {
        if (at_end_ && end_ == from && at_end_->band() >= band)
            begin = at_end_;
        else if (!moved && from == whole)
            begin = body_->at(clock, frame - 1, band);
        else
            begin = body_->build(mesh_of(*mesh.rest(), curves, 0), band);
    }
    at_end_ = to == static_cast<double>(frame) ? at_frame(frame) : build(mesh_of(*mesh.rest(), curves, 1), band);
    end_ = to;
    return {deforming_shape(begin, at_end_, body_->tree(), std::move(curves), (to - from) / clock.fps), path.jump};
}

}  // namespace rapid

// Shapes with a pose, queried in their rest frame, so that a rotated shape is not rebuilt.
//
// A pose preserves angles, so paths stay parabolas and contacts are those of the rest shape.
#pragma once

#include <span>
#include <vector>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/pose.h"
#include "runtime/shapes/scatter/scatter.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// Base: Shape, or LevelSet.
template <class Base>
class PlacedOf : public Base {
public:
    using RestPtr = std::shared_ptr<const Base>;
    PlacedOf(RestPtr rest, const Pose& pose) : rest_(std::move(rest)), pose_(pose), to_rest_(pose.inverse()) {}

    const RestPtr& rest() const { return rest_; }
    const Pose& pose() const { return pose_; }

    std::string_view kind() const override { return rest_->kind(); }
    Box3d bounds() const override;
    double band() const override { return pose_.scale * rest_->band(); }
    double slope_bound() const override { return rest_->slope_bound(); }
    double smallest_feature() const override { return pose_.scale * rest_->smallest_feature(); }
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override;
    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override;
    ScatterPtr surface_scatter() const override;
    ScatterPtr volume_scatter() const override;
    MeshPtr surface() const override;

private:
    RestPtr rest_;
    Pose pose_, to_rest_;
};

// A rotated level set.
class PlacedLevelSet final : public PlacedOf<LevelSet> {
public:
    using PlacedOf::PlacedOf;

    double voxel() const override { return pose().scale * rest()->voxel(); }
    std::uint64_t active_voxels() const override { return rest()->active_voxels(); }
    LevelSetPtr with_band(double metres) const override;
    void write(const std::filesystem::path& path, const std::string& grid) const override;
};

// Returns the bounds of a moved box. An infinite box becomes infinite along all axes if it is rotated.
Box3d moved(const Pose& pose, const Box3d& box);

// Moves a shape that is not a level set (for those see level_set_tools.h) by a pose.
ShapePtr placed(const ShapePtr& rest, const Pose& pose);

}  // namespace rapid

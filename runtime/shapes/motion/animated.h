// Time-dependent meshes and shapes: the results of `:transform` with a motion, and file sequences. They have no pose of
// their own; users evaluate them at the frames they need.
#pragma once

#include <cmath>

#include "runtime/base/in_motion.h"
#include "runtime/shapes/mesh/deforming_mesh.h"
#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// A mesh that moves rigidly, deforms, or both. Its topology is constant.
class AnimatedMesh : public Object {
public:
    static constexpr std::string_view param_type = "moving mesh";

    AnimatedMesh(MeshPtr mesh, MotionPtr motion) : rest_(std::move(mesh)), motion_(std::move(motion)) {}
    AnimatedMesh(DeformingMeshPtr deforming, MotionPtr motion)
        : rest_(deforming->rest()), deforming_(std::move(deforming)), motion_(std::move(motion))
    {
    }

    std::string_view kind() const override { return "moving mesh"; }
    bool varies() const override { return true; }

    bool deforms() const { return deforming_ != nullptr; }
    const MeshPtr& rest() const { return rest_; }  // mesh of the first file of a sequence, without the motion
    const MotionPtr& motion() const { return motion_; }
    FrameRange range() const;
    // Returns true if the mesh at a frame depends on the rate of the clock, or on its start.
    bool depends_on_clock() const { return motion_->varies() || (deforming_ && deforming_->depends_on_clock()); }

    // Returns true if there is a mesh at a whole frame. A sequence may have none beyond its files.
    bool has(std::int64_t frame) const { return !deforming_ || deforming_->has(frame); }
    // Returns true if there is a mesh throughout the time between two frames, which may be fractional.
    bool has(double from, double to) const
    {
        return has(static_cast<std::int64_t>(std::floor(from))) && has(static_cast<std::int64_t>(std::ceil(to)));
    }

    // Adds another motion after its own.
    std::shared_ptr<const AnimatedMesh> transformed(const MotionPtr& motion) const;

    // Returns the mesh at a whole frame. Single-threaded, because the motion may be a script.
    MeshPtr at(const FrameClock& clock, std::int64_t frame) const;

private:
    MeshPtr rest_;
    DeformingMeshPtr deforming_;  // null if the mesh does not deform
    MotionPtr motion_;
};

// The mesh of one frame of a moving mesh.
class MeshOfFrame : public Mesh, public StateInMotion {
public:
    MeshOfFrame(const Mesh& mesh, std::shared_ptr<const AnimatedMesh> moving, std::int64_t frame)
        : Mesh(mesh), moving_(std::move(moving)), frame_(frame)
    {
    }

    ObjectPtr in_motion() const override { return moving_; }
    std::int64_t frame() const { return frame_; }

private:
    std::shared_ptr<const AnimatedMesh> moving_;
    std::int64_t frame_;
};

class AnimatedShape : public Object {
public:
    static constexpr std::string_view param_type = "moving shape";

    AnimatedShape(ShapePtr shape, MotionPtr motion) : rest_(std::move(shape)), motion_(std::move(motion)) {}
    std::string_view kind() const override { return "moving shape"; }
    bool varies() const override { return true; }

    const ShapePtr& rest() const { return rest_; }
    const MotionPtr& motion() const { return motion_; }

private:
    ShapePtr rest_;
    MotionPtr motion_;
};

}  // namespace rapid

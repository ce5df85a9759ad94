#include "runtime/shapes/motion/animated.h"

namespace rapid {

FrameRange AnimatedMesh::range() const
{
    FrameRange range = motion_->range();
    if (deforming_ && deforming_->begins() < deforming_->ends())
        range.extend({deforming_->begins(), deforming_->ends()});
    return range;
}

std::shared_ptr<const AnimatedMesh> AnimatedMesh::transformed(const MotionPtr& motion) const
{
    const MotionPtr both = product(motion, motion_);
    if (deforming_) return std::make_shared<AnimatedMesh>(deforming_, both);
    return std::make_shared<AnimatedMesh>(rest_, both);
}

MeshPtr AnimatedMesh::at(const FrameClock& clock, std::int64_t frame) const
{
    const MeshPtr mesh = deforming_ ? deforming_->at(clock, frame) : rest_;
    const Pose pose = motion_->at(clock.at(static_cast<double>(frame)));
    if (pose.translation.isZero(0) && pose.rotation.vec().isZero(0) && pose.scale == 1) return mesh;
    return rapid::transformed(mesh, pose.affine());
}

}  // namespace rapid

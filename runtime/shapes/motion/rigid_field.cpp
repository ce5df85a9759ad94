#include "runtime/shapes/motion/rigid_field.h"

#include <algorithm>
#include <cmath>

namespace rapid {

RelativePath::RelativePath(const MotionTrack::Piece& piece, const Path& path, double first, double last)
    : piece_(&piece), path_(&path), first_(first), begin_(arm_at(first))
{
    const double T = last - first;
    const Arm& begin = begin_;
    const Arm end = arm_at(last);
    const double k = std::min(begin.scale, end.scale), growth = std::abs(piece.growth) / k;
    const double turning = piece.spin.norm(), a = (path.a - piece.a).norm();
    // The relative velocity is linear in time, so it is largest at an end. The path in between deviates from its chord
    // by at most a T²/8.
    const double speed = std::max(begin.relative_velocity.norm(), end.relative_velocity.norm());
    const double sag = a * T * T / 8, arm = std::max(begin.arm.norm(), end.arm.norm()) + sag;
    // Distances from the axis: the part along it does not turn.
    const auto lever = [&](const Vec3d& x) { return x.cross(piece.spin).norm(); };
    const double turned = turning > 0 ? std::max(lever(begin.arm), lever(end.arm)) + turning * sag : 0;
    acceleration_ =
        (a + 2 * turning * speed + turning * turned + 2 * growth * (speed + turned) + 2 * growth * growth * arm) / k;
    level_speed_ = std::abs(piece.growth) / (k * k);
    level_acceleration_ = 2 * growth * growth / k;
}

RelativePath::State RelativePath::at(double s) const
{
    const Arm f = s == first_ ? begin_ : arm_at(s);
    const Eigen::Quaterniond back = f.rotation.conjugate();
    const Vec3d slip = f.relative_velocity - piece_->spin.cross(f.arm) - piece_->growth / f.scale * f.arm;
    return {back * f.arm / f.scale, back * slip / f.scale, f.scale, f.rotation, piece_->growth / (f.scale * f.scale)};
}

RelativePath::Arm RelativePath::arm_at(double s) const
{
    const double t = path_->begin + s;
    const Pose pose = piece_->at(t);
    return {path_->at(s) - pose.translation, path_->velocity(s) - (piece_->v + (t - piece_->begin) * piece_->a),
            pose.rotation, pose.scale};
}

RestShape::RestShape(ShapePtr rest)
    : shape(std::move(rest)),
      slope_bound(shape->slope_bound()),
      feature(shape->smallest_feature()),
      rounding(std::isfinite(shape->band()) ? 0x1p-21 * shape->band() : 0)
{
}

}  // namespace rapid

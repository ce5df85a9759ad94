// The camera of a sequence.
//
// Later frames are unknown when the first one is drawn, and a camera that jumps or drifts makes a sequence useless. The
// first frame with points is therefore framed with room for their motion, and the camera holds still until something
// leaves its view. It then glides back far enough to hold still again. The lines on the ground keep the scale of the
// first frame. If the camera is given, the ground does not depend on the points.
#pragma once

#include <cstddef>
#include <optional>

#include "runtime/picture/frame_info.h"
#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Chooses the view of each frame from the preceding ones. Uses the camera of the options, or else that of the scene,
// and fits the parts that they leave open: to the first frame that has points (their positions now and half a second
// later, and the shapes), or to a group of the points, which is then followed.
class PictureFit {
public:
    PictureView next(const PointSet& points, const FrameInfo& frame);

    // Returns true if there have been points. Before that the view shows only the shapes and may still jump.
    bool settled() const { return max_points_ > 0; }

    // Serialises the complete state for the following views.
    template <class Archive>
    void serialize(Archive& keep)
    {
        bool is_there = view_.has_value();
        keep(is_there);
        if (is_there) {
            if (!view_) view_.emplace();
            keep(view_->camera.position, view_->camera.target, view_->camera.fov, view_->full_speed, view_->min_radius,
                 view_->bounds.min(), view_->bounds.max(), view_->line_spacing);
        }
        keep(seen_.min(), seen_.max(), goal_.min(), goal_.max(), time_, max_points_);
    }

private:
    void approach(double part);

    std::optional<PictureView> view_;
    Box3d seen_;  // bounds of everything so far, or of the framed group
    Box3d goal_;  // the bounds towards which those of the view glide
    double time_ = 0;
    std::size_t max_points_ = 0;
};

}  // namespace rapid

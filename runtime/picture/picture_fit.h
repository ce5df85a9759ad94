// The camera of a sequence.
//
// The later frames are unknown when the first is drawn, and a camera that jumps or drifts makes a sequence useless. So
// the first frame with points is framed with room for where they go, and the camera holds still until something leaves
// its view; then it glides back far enough to hold still again. The lines on the ground keep the first frame's scale;
// under a camera that is given, the ground does not depend on the points.
#pragma once

#include <cstddef>
#include <optional>

#include "runtime/picture/frame_info.h"
#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Chooses the view of each frame from the ones before it. The camera of the options is taken, or else that of the
// scene; what these leave open is fitted: to the first frame that has points (to them, to where they will be half a
// second later, and to the shapes), or to a group of the points, which is then followed.
class PictureFit {
public:
    PictureView next(const PointSet& points, const FrameInfo& frame);

    // Whether there have been points. Before that the view shows the shapes alone and may still jump.
    bool settled() const { return most_points_ > 0; }

    // All that the next views depend on.
    template <class Archive>
    void serialize(Archive& keep)
    {
        bool is_there = view_.has_value();
        keep(is_there);
        if (is_there) {
            if (!view_) view_.emplace();
            keep(view_->camera.position, view_->camera.target, view_->camera.fov, view_->full_speed,
                 view_->least_radius, view_->bounds.min(), view_->bounds.max(), view_->line_spacing);
        }
        keep(seen_.min(), seen_.max(), goal_.min(), goal_.max(), time_, most_points_);
    }

private:
    void approach(double part);

    std::optional<PictureView> view_;
    Box3d seen_;  // the bounds of everything so far, or of the group that is framed
    Box3d goal_;  // to which those of the view glide
    double time_ = 0;
    std::size_t most_points_ = 0;
};

}  // namespace rapid

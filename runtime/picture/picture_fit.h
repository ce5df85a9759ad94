// The camera of a sequence.
//
// The later frames are unknown when the first is drawn, and a camera that jumps makes a sequence useless. So the first
// frame with points is framed with room for where they go, and later the camera only glides back.
#pragma once

#include <cstddef>
#include <optional>

#include "runtime/picture/frame_info.h"
#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Chooses the view of each frame from the ones before it: the camera is fitted to the first frame that has points
// (to them, to where they will be half a second later, and to the shapes), and from then on only glides back when
// points come near the edge of what it sees.
class PictureFit {
public:
    PictureView next(const PointSet& points, const FrameInfo& frame);

    // Whether there have been points. Before that the view shows the shapes alone and may still jump.
    bool settled() const { return most_points_ > 0; }

private:
    std::optional<PictureView> view_;
    Box3d seen_;  // the bounds of everything so far
    double time_ = 0;
    std::size_t most_points_ = 0;
};

}  // namespace rapid

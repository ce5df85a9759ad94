// A rigid shape that moves during an interval of time (paper §4.4): the rest shape, queried in its own frame at each
// point's own time, with the velocity of the surface at the contact. It is never rebuilt.
#pragma once

#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// A MovingBody, which may also grow, between two frames, whole or not; times (Path::begin, distance_at) are in seconds
// since `from`. distance() is that at the end. On one thread, as the motion is evaluated here, ahead; the result may be
// queried from any.
//
// Contacts are those of the path with the track of the motion (MotionTrack): to rounding, at any speed. Where the shape
// only translates, the path is a parabola in its frame too, and the rest shape finds the contact; where it turns or
// grows, a walk by a bound on the acceleration in that frame does, and passes no wall of two features.
ShapePtr moving(const ShapePtr& rest, const Motion& motion, const FrameClock& clock, double from, double to);

// The same through a step; after a jump in it as it goes on from there, backwards.
struct MovingStep {
    ShapePtr shape;
    std::optional<Jump> jump;  // detected in the step
};
MovingStep moving_in_step(const AnimatedShape& shape, const FrameClock& clock, std::int64_t step,
                          const PathOptions& options);

}  // namespace rapid

// A rigid shape that moves during a time interval (paper §4.4). The rest shape is queried in its own frame at each
// point's own time, and contacts include the velocity of the surface. It is never rebuilt.
#pragma once

#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// Returns a MovingBody, which may also grow, between two frames, which may be fractional. Times (Path::begin,
// distance_at) are in seconds since `from`, and distance() applies to the end. Single-threaded, as it evaluates the
// motion in advance; the result is thread-safe.
//
// Contacts with the track of the motion (MotionTrack) are exact up to rounding, at any speed. If the shape only
// translates, the path is a parabola in its frame too, and the rest shape finds the contact. If it turns or grows, a
// walk with a bound on the acceleration in that frame finds it, and passes no wall as thick as two features.
ShapePtr moving(const ShapePtr& rest, const Motion& motion, const FrameClock& clock, double from, double to);

// Does the same for a step. A step with a jump uses the motion after the jump, mirrored in time.
struct MovingStep {
    ShapePtr shape;
    std::optional<Jump> jump;  // detected in the step
};
MovingStep moving_in_step(const AnimatedShape& shape, const FrameClock& clock, std::int64_t step,
                          const PathOptions& options);

}  // namespace rapid

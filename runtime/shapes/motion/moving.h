// A shape that moves during an interval of time (paper §4.4): the rest shape, asked in its own frame at each point's
// own time, with the velocity of the surface where it is hit. It is never built again.
#pragma once

#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// A body whose every part moves with it.
class RigidBody : public Shape {
public:
    // The acceleration, m/s², of what moves at the velocity v (m/s) at a place, straight and evenly as the body sees
    // it: what is accelerated otherwise is pressed to its surface, or drawn off it. time: s since its interval began.
    virtual Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const = 0;
};

// Between two frames, whole or not; times (Path::begin, distance_at) are in seconds since `from`. distance() is that at
// the end. On one thread, as the motion is asked here, ahead; the result is asked from any.
//
// Contacts are those of the motion's track (MotionTrack) with the path: to rounding, at any speed. Where the shape only
// moves along, the path is a parabola in its frame too, and the rest shape finds the contact; where it turns or grows,
// a walk does that goes by a bound on the acceleration in that frame, and passes no wall of two features.
ShapePtr moving(const ShapePtr& rest, const Motion& motion, const FrameClock& clock, double from, double to);

}  // namespace rapid

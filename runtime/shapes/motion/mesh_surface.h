// The surface of a mesh, at rest, moving or deforming: the distance to its nearest face, at any distance. A mesh need
// not be closed, and has no inside: the distance is never below 0, and nothing collides with it.
#pragma once

#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

using MovingBodyPtr = std::shared_ptr<const MovingBody>;

MovingBodyPtr mesh_surface(const MeshPtr& mesh);
// Whether a shape is one: its distance is above 0 on both sides.
bool is_mesh_surface(const Shape& shape);

// As it is at the start; and through a step: times are in seconds since the step began, and distance() is that at its
// end. Vertices of a sequence follow the curves of body_path.h. On one thread: the motion may be a script.
MovingBodyPtr mesh_surface_at_start(const AnimatedMesh& mesh, const FrameClock& clock);
MovingBodyPtr mesh_surface_in_step(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t step);

}  // namespace rapid

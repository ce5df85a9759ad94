// The surface of a mesh, static, moving or deforming: the unsigned distance to its nearest face, exact everywhere. The
// mesh may be open. It has no inside, and nothing collides with it.
#pragma once

#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

using MovingBodyPtr = std::shared_ptr<const MovingBody>;

MovingBodyPtr mesh_surface(const MeshPtr& mesh);
// Returns true if a shape is a mesh surface, whose distance is above 0 on both sides.
bool is_mesh_surface(const Shape& shape);

// Returns the surface at the start, or during a step. Times are in seconds since the step began, and distance() applies
// to its end. Vertices of a sequence follow the curves of body_path.h. Single-threaded, because the motion may be a
// script.
MovingBodyPtr mesh_surface_at_start(const AnimatedMesh& mesh, const FrameClock& clock);
MovingBodyPtr mesh_surface_in_step(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t step);

}  // namespace rapid

// Shapes given by a formula: exact everywhere, and no grid.
#pragma once

#include "runtime/shapes/shape.h"

namespace rapid {

// The points with normal · x <= offset are inside. Error: a normal of length 0.
ShapePtr make_plane(const Vec3d& normal, double offset);
// Metres, above 0; a box's size is its full edge lengths. Error: one that is not.
ShapePtr make_sphere_shape(double radius, const Vec3d& center);
ShapePtr make_box_shape(const Vec3d& size, const Vec3d& center);

}  // namespace rapid

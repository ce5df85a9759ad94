// Shapes defined by a formula: exact everywhere, without a grid. These functions are for C++. Scenes create a shape
// through its declaration (shape_type.h).
#pragma once

#include "runtime/shapes/shape.h"

namespace rapid {

// Creates the half space normal · x <= offset. Throws Error if the normal has length 0.
ShapePtr make_plane(const Vec3d& normal, double offset);
// Lengths are in metres; the size of a box is its full edge lengths. Both throw Error if a length is not above 0.
ShapePtr make_sphere_shape(double radius, const Vec3d& center);
ShapePtr make_box_shape(const Vec3d& size, const Vec3d& center);

}  // namespace rapid

// Shapes given by a formula: exact everywhere, and without a grid. These are for C++; scenes find a shape by its
// declaration (shape_type.h).
#pragma once

#include "runtime/shapes/shape.h"

namespace rapid {

// Inside is normal · x <= offset. Error: a normal of length 0.
ShapePtr make_plane(const Vec3d& normal, double offset);
// Lengths in metres; the size of a box is its full edge lengths. Error: a length that is not above 0.
ShapePtr make_sphere_shape(double radius, const Vec3d& center);
ShapePtr make_box_shape(const Vec3d& size, const Vec3d& center);

}  // namespace rapid

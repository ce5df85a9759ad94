// Polygons as triangles.
#pragma once

#include <span>
#include <vector>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Cuts ears off a polygon of three corners or more, from its second on: a convex one becomes a fan about its first. It
// need not be convex, nor quite flat. The corners index `positions`.
void append_polygon(std::span<const Vec3f> positions, std::span<const std::int32_t> corners,
                    std::vector<Mesh::Triangle>& triangles);

}  // namespace rapid

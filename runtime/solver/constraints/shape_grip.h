// Which shapes points rest on, and how these hold them: in one number a point, which changes when a shape comes, goes,
// moves, or has another friction.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"

namespace rapid {

// A shape is touched that is as near as this, in radii: what rests on one is flush with it.
constexpr double touch = 0.01;

// 1 and the friction for each shape that a point touches, and more for one that it is in. points: indices in P; time: s
// since the beginning of the frame.
std::vector<float> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                               std::span<const Vec3d> P, double time);

}  // namespace rapid

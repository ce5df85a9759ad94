// A fingerprint of the shapes that points rest on. It changes when a shape is added, removed, moved or tilted, or
// changes its friction, bounce or response.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"

namespace rapid {

// Distance, in radii, below which a point touches a shape; a resting point may also be flush with it.
constexpr double touch = 0.01;

struct ShapeGrip {
    std::uint64_t hash = 0;        // of the touched shapes' indices in the chain and their parameters
    Vec3f normal = Vec3f::Zero();  // the sum of their normals

    bool is_like(const ShapeGrip& other) const;
};

// Returns the grips of the points with these indices in P; time: s since the beginning of the frame.
std::vector<ShapeGrip> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time);

}  // namespace rapid

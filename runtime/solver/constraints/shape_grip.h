// Which shapes points rest on, and how these hold them: what changes when a shape comes, goes, moves or tilts, or is
// given another friction, bounce or response.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"

namespace rapid {

// A shape is touched that is as near as this, in radii, or flush: what rests on one is flush with it.
constexpr double touch = 0.01;

struct ShapeGrip {
    std::uint64_t hash = 0;        // of the touched shapes' places in the chain and of their parameters
    Vec3f normal = Vec3f::Zero();  // the sum of their normals

    bool is_like(const ShapeGrip& other) const;
};

// Of the points with these indices in P; time: s since the beginning of the frame.
std::vector<ShapeGrip> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time);

}  // namespace rapid

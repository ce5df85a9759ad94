// Directions that are uniform over the solid angle of a cone.
#pragma once

#include <span>

#include "runtime/operators/emit/draws.h"
#include "runtime/vec.h"

namespace rapid {

class Cone {
public:
    explicit Cone(double half_angle);

    // Turns each vector within the cone around it; its length stays. Spans have shape [n].
    void turn(std::span<Vec3d> vectors, std::span<const Draws> draws) const;

private:
    double depth_;  // 1 - cos θ, θ: the half angle
};

}  // namespace rapid

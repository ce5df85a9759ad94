// The random numbers of a birth, and directions that are uniform over the solid angle of a cone. Each draw has a
// number of its own, so that adding a parameter does not change other draws. The birthplace uses separate random
// numbers (emit/birth_source.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "runtime/math/vec.h"

namespace rapid {

constexpr std::uint64_t draw_use = 16;
constexpr std::uint64_t speed_use = 20, phase_use = 21;  // 17 is used for source points (emit/birth_source.cpp)
enum Draw { age_draw, life_draw, cone_draw, turn_draw };
using Draws = std::array<double, 4>;  // uniform in [0, 1), by Draw

class Cone {
public:
    explicit Cone(double half_angle);

    // Turns each vector within the cone around it and keeps its length. Spans have shape [n].
    void turn(std::span<Vec3d> vectors, std::span<const Draws> draws) const;

private:
    double depth_;  // 1 - cos θ, θ: the half angle
};

}  // namespace rapid

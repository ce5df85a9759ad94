// The random numbers of a birth. Each question has a number of its own, so that a further parameter changes no answer
// to another; the birthplace draws from other uses (birth_source.h).
#pragma once

#include <array>
#include <cstdint>

namespace rapid {

constexpr std::uint64_t draw_use = 16;
constexpr std::uint64_t speed_use = 20, phase_use = 21;  // 17 is that of source points (birth_source.cpp)
enum Draw { age_draw, life_draw, cone_draw, turn_draw };
using Draws = std::array<double, 4>;  // uniform in [0, 1), by Draw

}  // namespace rapid

// Gradient noise (Perlin 2002): a smooth random field of place and time, with its exact gradient, and the curl of three
// of them (Bridson et al. 2007): a field of velocities that neither gathers nor spreads points.
//
// A field is a sum of octaves, each twice as fine in place and time as the one before and half as strong. The lattice
// of the first has cells of 1 m and 1 s and the values 0 at its corners; divide by a size to have larger ones. Values
// are twice continuously differentiable, differ for every seed, and are the same bits on every machine: integers choose
// the gradients, and what follows is addition and multiplication.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/vec.h"

namespace rapid {

struct NoiseOptions {
    double time = 0;  // s; at whole times, as at 0, the field costs half
    int octaves = 1;  // from 1 to most_octaves
    std::uint32_t seed = 0;

    static constexpr int most_octaves = 16;
};

// In [-1, 1], with mean 0 and, for one octave, a root mean square of 0.19. `gradient`, 1/m, where it is asked for.
double noise(const Vec3d& P, const NoiseOptions& options, Vec3d* gradient = nullptr);

// The curl of a vector potential of three independent noises, scaled to a root mean square length of 1 at whole times
// (0.89 halfway between them). Its divergence is 0.
Vec3d curl_noise(const Vec3d& P, const NoiseOptions& options);

// The same bits for many points, several at a time; shapes [n], [n].
void curl_noise(std::span<const Vec3d> P, const NoiseOptions& options, std::span<Vec3d> curl);

}  // namespace rapid

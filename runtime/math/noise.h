// Gradient noise (Perlin 2002): a smooth random field in space and time, with its exact gradient; and curl noise
// (Bridson et al. 2007): a divergence-free vector field, the curl of three such fields.
//
// A field is a sum of octaves, each twice as fine in space and time and half as strong as the previous one. The lattice
// of the first has cells of 1 m and 1 s and the value 0 at its corners. Divide positions by a size for larger cells.
// Values are twice continuously differentiable, differ for every seed, and are bit-identical on every machine: integers
// choose the gradients, and the rest is addition and multiplication.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/math/vec.h"

namespace rapid {

struct NoiseOptions {
    double time = 0;  // s; the field costs half at whole times, such as 0
    int octaves = 1;  // from 1 to max_octaves
    std::uint32_t seed = 0;

    static constexpr int max_octaves = 16;
};

// Returns a value in [-1, 1] with mean 0 and, for one octave, a root mean square of 0.19. gradient: 1/m; may be null.
double noise(const Vec3d& P, const NoiseOptions& options, Vec3d* gradient = nullptr);

// Returns the curl of a vector potential of three independent noises, scaled to a root mean square length of 1 at whole
// times (0.89 halfway between them). Its divergence is 0.
Vec3d curl_noise(const Vec3d& P, const NoiseOptions& options);

// Computes the same for many points, several at a time, with bit-identical results; shapes [n], [n].
void curl_noise(std::span<const Vec3d> P, const NoiseOptions& options, std::span<Vec3d> curl);

}  // namespace rapid

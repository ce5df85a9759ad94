// Whether a parabola may come near a box, by the bounding box of the path.
//
//   x(s) = P + v s + a s²/2, s in [0, T]   lies between its ends, but for |a| T²/8, by which it may be off its chord
//
// Works on one coordinate at a time, as a double or as a pack of eight.
#pragma once

#include "runtime/simd.h"
#include "runtime/vec.h"

namespace rapid {

// Relative: a point that lies flush on a box may be off it by rounding to single precision.
constexpr double flush_tolerance = 0x1p-21;

// The interval of one coordinate of a path.
template <class T>
struct PathExtent {
    T low, high;

    // sagging: how far the path may be off its chord, m.
    [[gnu::always_inline]] static PathExtent of(const T& from, const T& to, const T& sagging)
    {
        const T magnitude = from > -from ? from : -from;
        const T margin = sagging + flush_tolerance * magnitude;
        return {(to < from ? to : from) - margin, (to > from ? to : from) + margin};
    }

    // Whether it is off the interval [min, max] of a box: by one coordinate, a path misses it.
    [[gnu::always_inline]] auto misses(const T& min, const T& max) const { return (high < min) | (low > max); }
};

// A box, widened for points of this radius (m).
inline Box3d widened(const Box3d& box, double radius)
{
    const Vec3d margin = Vec3d::Constant(radius * (1 + flush_tolerance));
    return {box.min() - margin, box.max() + margin};
}

}  // namespace rapid

// Tests whether a parabola may come near a box, using the bounding box of the path.
//
// x(s) = P + v s + a s²/2, s in [0, T], lies between its ends up to |a| T²/8, its largest deviation from the chord.
//
// Works on one coordinate at a time, as a double or as a pack of eight.
#pragma once

#include "runtime/math/simd.h"
#include "runtime/math/vec.h"

namespace rapid {

// Relative tolerance. Rounding to single precision may displace a point that lies flush on a box.
constexpr double flush_tolerance = 0x1p-21;

// The interval of one coordinate of a path.
template <class T>
struct PathExtent {
    T low, high;

    // sagging: bound on the path's deviation from its chord, m.
    [[gnu::always_inline]] static PathExtent of(const T& from, const T& to, const T& sagging)
    {
        const T magnitude = from > -from ? from : -from;
        const T margin = sagging + flush_tolerance * magnitude;
        return {(to < from ? to : from) - margin, (to > from ? to : from) + margin};
    }

    // Returns true if the extent does not meet the interval [min, max] of a box. One such coordinate suffices for a
    // miss.
    [[gnu::always_inline]] auto misses(const T& min, const T& max) const { return (high < min) | (low > max); }
};

// Returns a box widened for points of this radius (m).
inline Box3d widened(const Box3d& box, double radius)
{
    const Vec3d margin = Vec3d::Constant(radius * (1 + flush_tolerance));
    return {box.min() - margin, box.max() + margin};
}

}  // namespace rapid

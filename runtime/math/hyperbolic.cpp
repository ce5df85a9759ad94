#include "runtime/math/hyperbolic.h"

#include <cmath>

#include "runtime/math/power.h"

namespace rapid {
namespace {

using Parts = DoubleDouble<double>;

constexpr double small = 0.25;  // below it e^x and e^-x cancel; the series are short
constexpr double large = 22;    // above it e^-x is below the last digit of e^x

// Computes a Taylor series. Precondition: |x| < small.
Parts sine_of_small(double x)
{
    constexpr double s[] = {1 / 6.0, 1 / 120.0, 1 / 5040.0, 1 / 362880.0, 1 / 39916800.0, 1 / 6227020800.0};
    const double z = x * x;
    return exact_sum_of_ordered(x, x * z * elementary::polynomial_in_pairs(s, z));
}
Parts cosine_of_small(double x)
{
    constexpr double c[] = {1 / 24.0, 1 / 720.0, 1 / 40320.0, 1 / 3628800.0, 1 / 479001600.0};
    const Parts square = exact_product(x, 0.5 * x);
    const double z = x * x;
    return Parts{1, 0} + exact_sum_of_ordered(square.high, square.low + z * z * elementary::polynomial_in_pairs(c, z));
}

// Computes e^x and e^-x. Precondition: 0 <= x <= large.
struct Exponentials {
    Parts growing, falling;

    explicit Exponentials(double x)
    {
        const elementary::Octaves<double> octaves(x);
        const Parts value = elementary::exponential(octaves, 0.0);
        growing = {octaves.scale(value.high), octaves.scale(value.low)};
        falling = Parts{1, 0} / growing;
    }
};

// Returns e^x / 2, which is finite for some x at which e^x overflows.
double half_exponential(double x)
{
    const elementary::Octaves<double> octaves(x < 709 ? x : x - 64 * 0x1.62e42fefp-1);
    if (x < 709) return 0.5 * octaves.scale(elementary::exponential(octaves, 0.0).high);
    return octaves.scale(elementary::exponential(octaves, -64 * 0x1.473de6af278edp-34).high) * 0x1p63;
}

}  // namespace

double hyperbolic_sine(double x)
{
    const double size = std::abs(x);
    if (!(size >= 0x1p-30)) return x;
    if (size < small) return sine_of_small(x).high;
    if (size > large) return std::copysign(half_exponential(size), x);
    const Exponentials e(size);
    return std::copysign(0.5 * (e.growing - e.falling).high, x);
}

double hyperbolic_cosine(double x)
{
    const double size = std::abs(x);
    if (size < small) return cosine_of_small(x).high;
    if (!(size <= large)) return half_exponential(size);
    const Exponentials e(size);
    return 0.5 * (e.growing + e.falling).high;
}

double hyperbolic_tangent(double x)
{
    const double size = std::abs(x);
    if (!(size >= 0x1p-30)) return x;
    if (size < small) return (sine_of_small(x) / cosine_of_small(x)).high;
    if (size > large) return std::copysign(1.0, x);
    const Exponentials e(size);
    return std::copysign(((e.growing - e.falling) / (e.growing + e.falling)).high, x);
}

}  // namespace rapid

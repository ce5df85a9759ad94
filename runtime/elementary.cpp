#include "runtime/elementary.h"

#include <cmath>
#include <limits>

#include "runtime/large_angle.h"

namespace rapid {
namespace {

using elementary::Quarters;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns false also for NaN and infinity.
bool is_reduced(double x) { return std::abs(x) <= elementary::most_angle; }

Quarters<double> quarters_of(double x)
{
    if (is_reduced(x)) return Quarters<double>(x);
    if (!(std::abs(x) < infinity)) return {0, x - x, 0};  // NaN or infinity
    return quarters_of_large(x);
}

Doubles sine_of_lanes(const Doubles& x, std::int64_t quarters)
{
    Doubles value = by_registers(
        x, [&](const Register& part)
               __attribute__((always_inline)) { return elementary::sine(Quarters<Register>(part), quarters); });
    if (!any(!(magnitude(x) <= elementary::most_angle))) return value;
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (!is_reduced(x[l])) value[l] = elementary::sine(quarters_of(x[l]), quarters);
    return value;
}

}  // namespace

double sine(double x) { return elementary::sine(quarters_of(x), 0); }
double cosine(double x) { return elementary::sine(quarters_of(x), 1); }
double exponential(double x) { return elementary::exponential(x); }

SineAndCosine sine_and_cosine(double x)
{
    const Quarters<double> reduced = quarters_of(x);
    const double of_sine = elementary::sine_of_rest(reduced.r, reduced.tail);
    const double of_cosine = elementary::cosine_of_rest(reduced.r, reduced.tail);
    const bool is_odd = (reduced.n & 1) != 0;
    const double sine = is_odd ? of_cosine : of_sine, cosine = is_odd ? of_sine : of_cosine;
    return {(reduced.n & 2) != 0 ? -sine : sine, ((reduced.n + 1) & 2) != 0 ? -cosine : cosine};
}

// Computes sin / cos, or for an odd number of quarter turns -cos / sin, each in two parts.
double tangent(double x)
{
    if (std::abs(x) < 0x1p-30) return x;
    const auto [n, r, tail] = quarters_of(x);
    const DoubleDouble<double> square = exact_product(r, r), half = {0.5 * square.high, 0.5 * square.low};
    const double z = square.high;
    const DoubleDouble<double> sine =
        exact_sum_of_ordered(r, z * r * elementary::sine_series(z) + (tail - half.high * tail));
    const DoubleDouble<double> most = exact_sum_of_ordered(1.0, -half.high);
    const DoubleDouble<double> cosine =
        exact_sum_of_ordered(most.high, most.low + ((z * z * elementary::cosine_series(z) - r * tail) - half.low));
    return ((n & 1) != 0 ? -cosine / sine : sine / cosine).high;
}

Doubles sine(const Doubles& x) { return sine_of_lanes(x, 0); }
Doubles cosine(const Doubles& x) { return sine_of_lanes(x, 1); }

}  // namespace rapid

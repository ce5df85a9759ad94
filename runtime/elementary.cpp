#include "runtime/elementary.h"

#include <cmath>

namespace rapid {
namespace {

// An angle that is none, or infinite, is not within, either.
bool is_reduced(double x) { return std::abs(x) <= elementary::most_angle; }

// of_library: for the lanes beyond.
template <class OfLibrary>
Doubles sine_of_lanes(const Doubles& x, std::int64_t quarters, const OfLibrary& of_library)
{
    Doubles value = by_registers(
        x, [&](const Register& part) __attribute__((always_inline)) { return elementary::sine(part, quarters); });
    if (!any(!(magnitude(x) <= elementary::most_angle))) return value;
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (!is_reduced(x[l])) value[l] = of_library(x[l]);
    return value;
}

}  // namespace

double sine(double x) { return is_reduced(x) ? elementary::sine(x, 0) : std::sin(x); }
double cosine(double x) { return is_reduced(x) ? elementary::sine(x, 1) : std::cos(x); }
double exponential(double x) { return elementary::exponential(x); }

SineAndCosine sine_and_cosine(double x)
{
    if (!is_reduced(x)) return {std::sin(x), std::cos(x)};
    const elementary::Quarters<double> reduced(x);
    const double of_sine = elementary::sine_of_rest(reduced.r, reduced.tail);
    const double of_cosine = elementary::cosine_of_rest(reduced.r, reduced.tail);
    const bool is_odd = (reduced.n & 1) != 0;
    const double sine = is_odd ? of_cosine : of_sine, cosine = is_odd ? of_sine : of_cosine;
    return {(reduced.n & 2) != 0 ? -sine : sine, ((reduced.n + 1) & 2) != 0 ? -cosine : cosine};
}

Doubles sine(const Doubles& x)
{
    return sine_of_lanes(x, 0, [](double beyond) { return std::sin(beyond); });
}
Doubles cosine(const Doubles& x)
{
    return sine_of_lanes(x, 1, [](double beyond) { return std::cos(beyond); });
}

}  // namespace rapid

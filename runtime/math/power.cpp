#include "runtime/math/power.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rapid {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double min_normal = std::numeric_limits<double>::min(), largest = std::numeric_limits<double>::max();

bool has_logarithm(double x) { return x > 0 && x < HUGE_VAL; }

DoubleDouble<double> parts_of_logarithm(double x)
{
    return x < min_normal ? elementary::parts_of_logarithm(x * 0x1p54, -54) : elementary::parts_of_logarithm(x);
}

// Returns the logarithm of 0, infinity, NaN and negative numbers.
double beyond_logarithms(double x) { return x == 0 ? -HUGE_VAL : x > 0 ? x : no_number; }

bool is_whole(double y) { return std::floor(y) == y; }
bool is_odd(double y) { return is_whole(y) && !is_whole(y * 0.5); }

double power_of_positive(double x, double y)
{
    if (x == 1) return 1;
    const bool grows = (x > 1) == (y > 0);
    if (x == 0 || x == HUGE_VAL || std::abs(y) > 1e300) return grows ? HUGE_VAL : 0;
    return elementary::power(parts_of_logarithm(x), y);
}

// Applies f to each pair of registers of two packs.
template <class F>
Doubles by_registers_of_both(const Doubles& x, const Doubles& y, const F& f)
{
    struct Parts {
        Register of[sizeof(Doubles) / sizeof(Register)];
    };
    Parts a = std::bit_cast<Parts>(x);
    const Parts b = std::bit_cast<Parts>(y);
    for (std::size_t k = 0; k < std::size(a.of); ++k) a.of[k] = f(a.of[k], b.of[k]);
    return std::bit_cast<Doubles>(a);
}

// Returns pow(x, 0.5), which differs from sqrt(x) at -0 and -infinity.
double power_of_half(double x) { return x == -HUGE_VAL ? HUGE_VAL : std::sqrt(x) + 0.0; }

// Replaces the marked lanes of `value` by f(lane).
template <class F>
void replace_lanes(Doubles& value, const Flags& marked, const F& f)
{
    if (!any(marked)) return;
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (marked[l] != 0) value[l] = f(l);
}

}  // namespace

double logarithm(double x)
{
    if (!has_logarithm(x)) return beyond_logarithms(x);
    return x < min_normal ? elementary::logarithm(x * 0x1p54, -54) : elementary::logarithm(x);
}

double logarithm10(double x)
{
    if (!has_logarithm(x)) return beyond_logarithms(x);
    return (parts_of_logarithm(x) * DoubleDouble<double>{0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57}).high;
}

double logarithm(double x, double base)
{
    if (!has_logarithm(x) || !has_logarithm(base) || base == 1) return logarithm(x) / logarithm(base);
    return (parts_of_logarithm(x) / parts_of_logarithm(base)).high;
}

double power(double x, double y)
{
    if (y == 2) return x * x;
    if (y == 0.5) return power_of_half(x);
    if (y == -1) return 1 / x;
    if (y == 1) return x;
    if (y == 0 || x == 1) return 1;
    if (std::isnan(x) || std::isnan(y)) return no_number;
    if (!std::signbit(x)) return power_of_positive(x, y);
    if (x < 0 && x > -HUGE_VAL && !is_whole(y)) return no_number;
    const double size = power_of_positive(-x, y);
    return is_odd(y) ? -size : size;
}

double times_power_of_two(double x, double exponent)
{
    if (std::isnan(exponent)) return exponent;
    constexpr double beyond = 5000;  // takes any double to 0 or infinity
    return std::ldexp(x, static_cast<int>(std::clamp(exponent, -beyond, beyond)));
}

Doubles logarithm(const Doubles& x)
{
    Doubles value = by_registers(
        x, [](const Register& part) __attribute__((always_inline)) { return elementary::logarithm(part); });
    replace_lanes(value, ~((x >= min_normal) & (x <= largest)), [&](std::uint32_t l) { return logarithm(x[l]); });
    return value;
}

Doubles power(const Doubles& x, const Doubles& y)
{
    const auto all_are = [&](double exponent) { return !any(y != exponent); };
    if (all_are(0.5)) return x == -HUGE_VAL ? Doubles{} + HUGE_VAL : sqrt(x) + 0.0;
    if (all_are(-1)) return 1 / x;
    Doubles value = by_registers_of_both(
        x, y, [](const Register& base, const Register& exponent) __attribute__((always_inline)) {
            return elementary::power(elementary::parts_of_logarithm(base), exponent);
        });
    const Flags is_usual =
        (x >= min_normal) & (x <= largest) & (magnitude(y) <= 1e300) & (y != 1) & (y != 2) & (y != 0.5) & (y != -1);
    replace_lanes(value, ~is_usual, [&](std::uint32_t l) { return power(x[l], y[l]); });
    return value;
}

}  // namespace rapid

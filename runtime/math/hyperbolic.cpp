#include "runtime/math/hyperbolic.h"

#include <cmath>
#include <limits>

#include "runtime/math/elementary.h"
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

namespace {

using Parts = DoubleDouble<double>;

constexpr Parts pi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53},
                quarter_turn = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr double negligible = 0x1p-60;

// Returns c + arctan(n/d). Precondition: |n/d| <= 0.4375.
Parts angle_near(const Parts& c, const Parts& n, const Parts& d)
{
    // (t - arctan t) / t³ of z = t²; minimax, relative to 2e-17
    constexpr double p[] = {0x1.5555555555555p-2, -0x1.9999999999882p-3, 0x1.2492492481a9ep-3, -0x1.c71c71bab3065p-4,
                            0x1.745d14df51847p-4, -0x1.3b136adc32c02p-4, 0x1.110bee86fb343p-4, -0x1.e1629cfd332c7p-5,
                            0x1.aaff104457024p-5, -0x1.6e9335ebe18d7p-5, 0x1.0c205d44095ffp-5, -0x1.d74b2e582a152p-7};
    const Parts t = n / d;
    const double z = t.high * t.high;
    const Parts sum = exact_sum(c.high, t.high);
    const double rest = t.low * (1 - z) - t.high * z * elementary::polynomial_in_pairs(p, z);
    return exact_sum_of_ordered(sum.high, sum.low + (c.low + rest));
}

// Returns arctan(n/d). Precondition: n and d are 0 or positive, and not both 0.
Parts angle(const Parts& n, const Parts& d)
{
    struct Reference {
        double most, tangent;
        Parts angle;
    };
    // arctan(n/d) = arctan c + arctan((n - c d) / (d + c n))
    constexpr Reference references[] = {{0.4375, 0, {0, 0}},
                                        {0.6875, 0.5, {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56}},
                                        {1.1875, 1, {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}},
                                        {2.4375, 1.5, {0x1.f730bd281f69bp-1, 0x1.007887af0cbbdp-56}}};
    for (const auto& [most, c, of_c] : references)
        if (n.high < most * d.high)
            return c == 0 ? angle_near(of_c, n, d) : angle_near(of_c, n - Parts{c, 0} * d, d + Parts{c, 0} * n);
    return angle_near(quarter_turn, -d, n);
}

}  // namespace

double arc_tangent(double x)
{
    const double size = std::abs(x);
    if (!(size > 0x1p-30)) return x;
    const double value = size > 1 / negligible ? quarter_turn.high : angle({size, 0}, {1, 0}).high;
    return std::copysign(value, x);
}

double arc_tangent(double y, double x)
{
    if (std::isnan(x) || std::isnan(y)) return x + y;
    const bool is_behind = std::signbit(x);
    double opposite = std::abs(y), adjacent = std::abs(x);
    if (opposite == HUGE_VAL && adjacent == HUGE_VAL) opposite = adjacent = 1;
    if (opposite <= negligible * adjacent || opposite == 0)
        return is_behind ? std::copysign(pi.high, y) : adjacent == 0 ? y : std::copysign(opposite / adjacent, y);
    if (adjacent <= negligible * opposite) return std::copysign(quarter_turn.high, y);
    // Scales extreme arguments, whose products would overflow or lose digits.
    const double most = std::fmax(opposite, adjacent);
    const double scale = most > 0x1p500 ? 0x1p-600 : most < 0x1p-400 ? 0x1p600 : 1;
    const Parts value = angle({opposite * scale, 0}, {adjacent * scale, 0});
    return std::copysign((is_behind ? pi - value : value).high, y);
}

namespace {

// Returns √(1 - x²). Precondition: |x| <= 1.
Parts other_leg(double x)
{
    const Parts square = exact_product(x, x);
    return square_root(Parts{1, 0} - square);
}

}  // namespace

double arc_sine(double x)
{
    const double size = std::abs(x);
    if (!(size <= 1)) return std::numeric_limits<double>::quiet_NaN();
    return size < 0x1p-30 ? x : std::copysign(angle({size, 0}, other_leg(x)).high, x);
}

double arc_cosine(double x)
{
    if (!(std::abs(x) <= 1)) return std::numeric_limits<double>::quiet_NaN();
    const Parts value = angle(other_leg(x), {std::abs(x), 0});
    return (x < 0 ? pi - value : value).high;
}

}  // namespace rapid

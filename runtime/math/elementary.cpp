#include "runtime/math/elementary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rapid {
namespace {

// Range reduction for angles that are too large for a few parts of π.

// The binary digits of 2/π after the point, 64 per word. For the largest double the first 969 are skipped, and the
// quarter turns computed from the next 192 have an error of 2^-137.
constexpr std::uint64_t two_over_pi[] = {
    0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d};

// 256-bit integers, least significant word first.
using Long = std::array<std::uint64_t, 4>;

Long shifted_down(const Long& a, unsigned by)  // less than 64
{
    if (by == 0) return a;
    Long result{};
    for (std::size_t i = 0; i < a.size(); ++i) result[i] = a[i] >> by | (i + 1 < a.size() ? a[i + 1] << (64 - by) : 0);
    return result;
}

// Returns m times the 192 bits of 2/π that start at bit `first`.
Long product(std::uint64_t m, unsigned first)
{
    __extension__ typedef unsigned __int128 Wide;
    const unsigned word = first / 64, bit = first % 64;
    Long result{};
    std::uint64_t carry = 0;
    for (unsigned i = 0; i < 3; ++i) {
        const std::uint64_t* const digits = two_over_pi + word + (2 - i);
        const std::uint64_t part = bit == 0 ? digits[0] : digits[0] << bit | digits[1] >> (64 - bit);
        const Wide sum = static_cast<Wide>(m) * part + carry;
        result[i] = static_cast<std::uint64_t>(sum);
        carry = static_cast<std::uint64_t>(sum >> 64);
    }
    result[3] = carry;
    return result;
}

// Converts an integer below 2^64 exactly.
DoubleDouble<double> exactly(std::uint64_t n)
{
    return {static_cast<double>(n >> 32) * 0x1p32, static_cast<double>(n & 0xffffffff)};
}

// Returns the number of quarter turns, modulo 4, and the remaining angle (Payne and Hanek 1983). Precondition: the
// angle is finite, and |angle| > elementary::max_angle.
elementary::Quarters<double> quarters_of_large(double angle)
{
    int exponent = 0;
    const auto m = static_cast<std::uint64_t>(std::frexp(std::abs(angle), &exponent) * 0x1p53);
    exponent -= 53;  // |angle| = m 2^exponent
    // The leading bits of 2/π only add whole turns and are skipped. The next ones give the angle in quarter turns,
    // modulo 4, with 190 bits after the point.
    const int passed = std::max(exponent - 2, 0);
    Long turns = shifted_down(product(m, static_cast<unsigned>(passed)), static_cast<unsigned>(passed + 2 - exponent));
    auto quarters = static_cast<std::int64_t>(turns[2] >> 62);
    turns[2] &= ~std::uint64_t{0} >> 2;
    const bool is_above = (turns[2] >> 61) != 0;  // nearer to the next quarter turn
    if (is_above) {
        ++quarters;
        // The distance to the next quarter turn, up to 2^-190.
        turns = {~turns[0], ~turns[1], ~turns[2] & ~std::uint64_t{0} >> 2, 0};
    }
    const auto part = [&](std::size_t i, double unit) {
        const DoubleDouble<double> digits = exactly(turns[i]);
        return exact_sum(digits.high * unit, digits.low * unit);
    };
    const DoubleDouble<double> fraction = part(2, 0x1p-62) + (part(1, 0x1p-126) + part(0, 0x1p-190));
    DoubleDouble<double> rest = fraction * DoubleDouble<double>{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
    if (is_above) rest = -rest;
    return angle < 0 ? elementary::Quarters<double>(-quarters, -rest.high, -rest.low)
                     : elementary::Quarters<double>(quarters, rest.high, rest.low);
}

using elementary::Quarters;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns false also for NaN and infinity.
bool is_reduced(double x) { return std::abs(x) <= elementary::max_angle; }

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
    if (!any(!(magnitude(x) <= elementary::max_angle))) return value;
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

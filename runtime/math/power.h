// Logarithms and powers, bit-identical on every processor and for eight numbers at once, like the functions of
// elementary.h.
//
// The error is below 0.53 units in the last place, and below 0.9 for natural logarithms
// (tests/lanes/test_elementary_functions.cpp). A power that fits into a double is exact: 2^10 is 1024.
#pragma once

#include "runtime/math/elementary.h"

namespace rapid {

namespace elementary {

// Splits a normal positive number into 2^k m, with m in [1/√2, √2].
template <class T>
struct Mantissa {
    T m, count;  // count = k + octaves

    [[gnu::always_inline]] explicit Mantissa(const T& x, std::int64_t octaves = 0)
    {
        using Signed = typename Bits<T>::Signed;
        const Signed bits = std::bit_cast<Signed>(x);
        const Signed k = (bits - 0x3fe6a09e667f3bcd) >> 52;
        m = std::bit_cast<T>(bits - (k << 52));
        count = std::bit_cast<T>(k + (std::bit_cast<std::int64_t>(to_integer) + octaves)) - to_integer;
    }
};

// (artanh s / s - 1 - z/3) / z² as a series in z = s²
constexpr double artanh_series[] = {1 / 5.0,  1 / 7.0,  1 / 9.0,  1 / 11.0, 1 / 13.0, 1 / 15.0,
                                    1 / 17.0, 1 / 19.0, 1 / 21.0, 1 / 23.0, 1 / 25.0};

// Returns the logarithm of 2^octaves x, for a normal positive x. With f = m - 1 and s = f / (2 + f), log m = 2 artanh s
// = f - (f²/2 - s (f²/2 + 2 (artanh s / s - 1))).
template <class T>
[[gnu::always_inline]] inline T logarithm(const T& x, std::int64_t octaves = 0)
{
    const Mantissa<T> of_x(x, octaves);
    const T f = of_x.m - 1, s = f / (2 + f), z = s * s, half = 0.5 * f * f;
    const T rest = 2 * z * (1 / 3.0 + z * polynomial_in_pairs(artanh_series, z));
    const T low = of_x.count * 0x1.473de6af278edp-34;
    return of_x.count * 0x1.62e42fefp-1 - ((half - (s * (half + rest) + low)) - f);
}

// Returns the same logarithm with a relative error below 2^-65.
template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> parts_of_logarithm(const T& x, std::int64_t octaves = 0)
{
    const Mantissa<T> of_x(x, octaves);
    const T one = T{} + 1.0;
    const DoubleDouble<T> s = DoubleDouble<T>{of_x.m - one, T{}} / exact_sum(of_x.m, one);
    const DoubleDouble<T> z = s * s;
    const DoubleDouble<T> third = z * DoubleDouble<T>{T{} + 0x1.5555555555555p-2, T{} + 0x1.5555555555555p-56};
    const T others = z.high * z.high * polynomial_in_pairs(artanh_series, z.high);
    const DoubleDouble<T> series = exact_sum_of_ordered(third.high, third.low + others);
    const DoubleDouble<T> half = s + s * series;
    const DoubleDouble<T> of_octaves = {of_x.count * 0x1.62e42fefp-1, of_x.count * 0x1.473de6af278edp-34};
    return of_octaves + DoubleDouble<T>{2 * half.high, 2 * half.low};
}

// Returns e^(x + below) / 2^k, where `octaves` are those of x.
template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> exponential(const Octaves<T>& octaves, const T& below)
{
    const T &r = octaves.r, tail = octaves.tail + below;
    const DoubleDouble<T> square = exact_product(r, 0.5 * r);
    const DoubleDouble<T> first = exact_sum_of_ordered(T{} + 1.0, r), second = exact_sum(first.high, square.high);
    const T cube = r * r * r * polynomial_in_pairs(exponential_series, r);
    return exact_sum_of_ordered(second.high,
                                ((first.low + second.low) + square.low) + (cube + tail * (second.high + cube)));
}

// Returns x^y, given the logarithm of x. Precondition: |y| <= 1e300.
template <class T>
[[gnu::always_inline]] inline T power(const DoubleDouble<T>& logarithm_of_x, const T& y)
{
    const DoubleDouble<T> product = exact_product(y, logarithm_of_x.high);
    const T below = product.low + y * logarithm_of_x.low;
    const T high = product.high;
    const Octaves<T> octaves(high);
    const T size = high < 0 ? -high : high;
    return octaves.scale(exponential(octaves, size < 800 ? below : T{}).high);
}

}  // namespace elementary

double logarithm(double x);
double logarithm10(double x);
double logarithm(double x, double base);

// Returns x^y with the special cases of C's pow. x^2 is x * x, x^0.5 a square root and x^-1 a quotient, each rounded
// once.
double power(double x, double y);

// Returns x 2^n, where n is the exponent rounded toward 0.
double times_power_of_two(double x, double exponent);

// Apply the same functions lane by lane.
Doubles logarithm(const Doubles& x);
Doubles power(const Doubles& x, const Doubles& y);

}  // namespace rapid

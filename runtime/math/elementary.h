// sin, cos and exp of doubles, bit-identical on every processor and for eight numbers at once. Those of the C library
// differ between its versions, and between processors with and without fused multiply-add.
//
// The error is below 0.9 units in the last place (tests/lanes/test_elementary.cpp).
#pragma once

#include <bit>
#include <cstdint>
#include <type_traits>

#include "runtime/math/simd.h"

namespace rapid {

// Numbers as unevaluated sums of two doubles, with twice the precision, for functions that round once at their end.
//
// The algorithms are those of Knuth (The Art of Computer Programming, 4.2.2) and Dekker (1971). None needs a fused
// multiply-add, so the results are bit-identical on every processor. T is a double or a vector of doubles.

// Integer types with the size of a double, or of a vector of doubles.
template <class T>
struct Bits {
    typedef std::int64_t Signed __attribute__((vector_size(sizeof(T))));
    typedef std::uint64_t Unsigned __attribute__((vector_size(sizeof(T))));
};
template <>
struct Bits<double> {
    using Signed = std::int64_t;
    using Unsigned = std::uint64_t;
};

template <class T>
struct DoubleDouble {
    T high, low;
};

// Returns a + b, exactly.
template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> exact_sum(const T& a, const T& b)
{
    const T sum = a + b, of_b = sum - a, of_a = sum - of_b;
    return {sum, (a - of_a) + (b - of_b)};
}

// Returns a + b exactly, but faster. Precondition: a is 0, or |a| >= |b|.
template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> exact_sum_of_ordered(const T& a, const T& b)
{
    const T sum = a + b;
    return {sum, b - (sum - a)};
}

// Returns a b with a relative error below 2^-104. Each factor is split into halves of 26 and 27 bits, whose products
// fit into a double except for one bit.
template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> exact_product(const T& a, const T& b)
{
    const auto upper_half = [](const T& x) __attribute__((always_inline))
    {
        return std::bit_cast<T>(std::bit_cast<typename Bits<T>::Signed>(x) & ~std::int64_t{0x7ffffff});
    };
    const T product = a * b;
    const T a_high = upper_half(a), b_high = upper_half(b), a_low = a - a_high, b_low = b - b_high;
    return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> operator+(const DoubleDouble<T>& a, const DoubleDouble<T>& b)
{
    const DoubleDouble<T> sum = exact_sum(a.high, b.high);
    return exact_sum_of_ordered(sum.high, sum.low + (a.low + b.low));
}

template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> operator-(const DoubleDouble<T>& a)
{
    return {-a.high, -a.low};
}

template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> operator-(const DoubleDouble<T>& a, const DoubleDouble<T>& b)
{
    return a + -b;
}

template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> operator*(const DoubleDouble<T>& a, const DoubleDouble<T>& b)
{
    const DoubleDouble<T> product = exact_product(a.high, b.high);
    return exact_sum_of_ordered(product.high, product.low + (a.high * b.low + a.low * b.high));
}

template <class T>
[[gnu::always_inline]] inline DoubleDouble<T> operator/(const DoubleDouble<T>& a, const DoubleDouble<T>& b)
{
    const T quotient = a.high / b.high;
    const DoubleDouble<T> product = exact_product(quotient, b.high);
    const T rest = ((a.high - product.high) - product.low) + (a.low - quotient * b.low);
    return exact_sum_of_ordered(quotient, rest / b.high);
}

// Returns the square root. Precondition: a is 0 or positive.
inline DoubleDouble<double> square_root(const DoubleDouble<double>& a)
{
    const double root = __builtin_sqrt(a.high);
    if (root == 0) return {0, 0};
    const DoubleDouble<double> square = exact_product(root, root);
    return exact_sum_of_ordered(root, (((a.high - square.high) - square.low) + a.low) / (2 * root));
}

namespace elementary {

constexpr double max_angle = 0x1p20;     // rad; larger angles need quarters_of_large()
constexpr double to_integer = 0x1.8p52;  // adding and subtracting it rounds; the integer is in the last bits

// Returns p[0] + p[1] x + p[2] x² + ...
template <class T, std::size_t n>
[[gnu::always_inline]] inline T polynomial(const double (&p)[n], const T& x)
{
    T sum = T{} + p[n - 1];
    for (std::size_t k = n - 1; k-- > 0;) sum = sum * x + p[k];
    return sum;
}

// Evaluates the same polynomial in pairs, pairs of pairs and so on (Estrin). It rounds differently. For a single number
// it takes about half the time, since its products do not wait for each other.
template <class T, std::size_t n>
[[gnu::always_inline]] inline T polynomial_in_pairs(const T (&p)[n], const T& x)
{
    if constexpr (n == 1) {
        return p[0];
    } else {
        T pairs[(n + 1) / 2];
        for (std::size_t k = 0; k < n / 2; ++k) pairs[k] = p[2 * k] + p[2 * k + 1] * x;
        if constexpr (n % 2 != 0) pairs[n / 2] = p[n - 1];
        return polynomial_in_pairs(pairs, T(x * x));
    }
}
template <class T, std::size_t n>
requires(!std::is_same_v<T, double>) [[gnu::always_inline]] inline T
    polynomial_in_pairs(const double (&p)[n], const T& x)
{
    T of_lanes[n];
    for (std::size_t k = 0; k < n; ++k) of_lanes[k] = T{} + p[k];
    return polynomial_in_pairs(of_lanes, x);
}

// Splits an angle into n quarter turns and r + tail, at most an eighth of a turn (Cody and Waite).
template <class T>
struct Quarters {
    typename Bits<T>::Signed n;
    T r, tail;

    [[gnu::always_inline]] explicit Quarters(const T& x)
    {
        const T biased = x * 0x1.45f306dc9c883p-1 + to_integer;
        const T count = biased - to_integer;
        n = std::bit_cast<typename Bits<T>::Signed>(biased);
        // A quarter turn is split into three parts of 33 bits, so that the products are exact, and a rest.
        const DoubleDouble<T> second = exact_sum(x - count * 0x1.921fb544p+0, count * -0x1.0b4611a6p-34);
        const DoubleDouble<T> third = exact_sum(second.high, count * -0x1.3198a2e0p-69);
        const T rest = count * 0x1.b839a252049c1p-104 - (second.low + third.low);
        r = third.high - rest;
        tail = (third.high - r) - rest;
    }
    [[gnu::always_inline]] Quarters(typename Bits<T>::Signed quarters, const T& rest, const T& below)
        : n(quarters), r(rest), tail(below)
    {
    }
};

// Evaluate minimax polynomials in z = r²: (sin r - r) / r³ and (cos r - 1 + z/2) / z². Their error is at most 2e-17
// relative to the sum that they are part of.
template <class T>
[[gnu::always_inline]] inline T sine_series(const T& z)
{
    constexpr double s[] = {-0x1.5555555555555p-3, 0x1.1111111110bb2p-7,   -0x1.a01a019e83816p-13,
                            0x1.71de379654304p-19, -0x1.ae600aca92c64p-26, 0x1.5e0b05bff20f2p-33};
    return polynomial(s, z);
}
template <class T>
[[gnu::always_inline]] inline T cosine_series(const T& z)
{
    constexpr double c[] = {0x1.5555555555555p-5,   -0x1.6c16c16c16967p-10, 0x1.a01a019f4e9b4p-16,
                            -0x1.27e4fa17bf139p-22, 0x1.1eeb68cd22f56p-29,  -0x1.907d8f29fe831p-37};
    return polynomial(c, z);
}

template <class T>
[[gnu::always_inline]] inline T sine_of_rest(const T& r, const T& tail)
{
    const T z = r * r;
    return r - ((0.5 * z * tail - tail) - z * r * sine_series(z));  // this form keeps -0
}

template <class T>
[[gnu::always_inline]] inline T cosine_of_rest(const T& r, const T& tail)
{
    const T z = r * r, half = 0.5 * z, most = 1 - half;
    return most + (((1 - most) - half) + (z * z * cosine_series(z) - r * tail));
}

// Returns the sine of an angle plus `quarters` quarter turns.
template <class T>
[[gnu::always_inline]] inline T sine(const Quarters<T>& reduced, std::int64_t quarters)
{
    const auto n = reduced.n + quarters;
    const T of_sine = sine_of_rest(reduced.r, reduced.tail), of_cosine = cosine_of_rest(reduced.r, reduced.tail);
    const T value = (n & 1) != 0 ? of_cosine : of_sine;
    return (n & 2) != 0 ? -value : value;
}

// Splits e^x into 2^k e^(r + tail), with |r| at most half of log 2. x is clamped to a range beyond which e^x is
// infinite or 0.
template <class T>
struct Octaves {
    T biased;  // k + to_integer
    T r, tail;

    [[gnu::always_inline]] explicit Octaves(const T& x)
    {
        const T most = T{} + 710.0, least = T{} - 746.0;
        const T below = x > most ? most : x, within = below < least ? least : below;
        // x = k log 2 + r, with log 2 split into 33 bits and a rest.
        biased = within * 0x1.71547652b82fep+0 + to_integer;
        const T count = biased - to_integer;
        const T high = within - count * 0x1.62e42fefp-1, low = count * 0x1.473de6af278edp-34;
        r = high - low;
        tail = (high - r) - low;
    }

    // Returns value 2^k, in two steps because the result may be subnormal.
    [[gnu::always_inline]] T scale(const T& value) const
    {
        using Unsigned = typename Bits<T>::Unsigned;
        const Unsigned both = std::bit_cast<Unsigned>(std::bit_cast<typename Bits<T>::Signed>(biased) -
                                                      std::bit_cast<std::int64_t>(to_integer) + 2046);
        const Unsigned first = both >> 1;
        return value * std::bit_cast<T>(first << 52) * std::bit_cast<T>((both - first) << 52);
    }
};

// (e^r - 1 - r - r²/2) / r³
constexpr double exponential_series[] = {
    0x1.5555555555556p-3,  0x1.5555555555555p-5,  0x1.11111111109a6p-7,  0x1.6c16c16c167dap-10, 0x1.a01a01a7cebcdp-13,
    0x1.a01a01a48116fp-16, 0x1.71de0d85293b8p-19, 0x1.27e4e1dcf773bp-22, 0x1.af390ba7e6f47p-26, 0x1.1f6717774d5e0p-29};

template <class T>
[[gnu::always_inline]] inline T exponential(const T& x)
{
    const Octaves<T> octaves(x);
    const T &r = octaves.r, &tail = octaves.tail;
    return octaves.scale(1 + (r + (tail + (0.5 * r * r + r * r * r * polynomial(exponential_series, r) + r * tail))));
}

}  // namespace elementary

double sine(double x);
double cosine(double x);
double tangent(double x);
double exponential(double x);

struct SineAndCosine {
    double sine, cosine;
};
SineAndCosine sine_and_cosine(double x);

// Apply the same functions to each lane.
Doubles sine(const Doubles& x);
Doubles cosine(const Doubles& x);
[[gnu::always_inline]] inline Doubles exponential(const Doubles& x)
{
    return by_registers(
        x, [](const Register& part) __attribute__((always_inline)) { return elementary::exponential(part); });
}

}  // namespace rapid

// sin, cos and exp of doubles, with the same bits on any processor and for eight numbers at once: those of the C
// library differ between its versions, and between processors with fused multiplication and without.
//
// The error is below 0.9 units in the last place (tests/lanes/test_elementary.cpp). Beyond 2^20 radians sine and cosine
// are the C library's.
#pragma once

#include <cstdint>

#include "runtime/simd.h"

namespace rapid {

namespace elementary {

// What a double or a vector of them is in bits.
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

constexpr double most_angle = 0x1p20;    // rad, that is reduced exactly
constexpr double to_integer = 0x1.8p52;  // added and taken off, it rounds; the integer is in the last bits

// p[0] + p[1] x + p[2] x² + ...
template <class T, std::size_t n>
[[gnu::always_inline]] inline T polynomial(const double (&p)[n], const T& x)
{
    T sum = T{} + p[n - 1];
    for (std::size_t k = n - 1; k-- > 0;) sum = sum * x + p[k];
    return sum;
}

// a - b and its rounding error (Knuth, The Art of Computer Programming, 4.2.2).
template <class T>
struct Difference {
    T rounded, error;

    [[gnu::always_inline]] Difference(const T& a, const T& b) : rounded(a - b)
    {
        const T of_b = a - rounded, of_a = rounded + of_b;
        error = (a - of_a) - (b - of_b);
    }
};

// An angle is n quarter turns and r + tail, at most an eighth turn either way (Cody and Waite).
template <class T>
struct Quarters {
    typename Bits<T>::Signed n;
    T r, tail;

    [[gnu::always_inline]] explicit Quarters(const T& x)
    {
        const T biased = x * 0x1.45f306dc9c883p-1 + to_integer;
        const T count = biased - to_integer;
        n = std::bit_cast<typename Bits<T>::Signed>(biased);
        // A quarter turn in three parts of 33 bits, so that the products are exact, and a rest.
        const Difference<T> second(x - count * 0x1.921fb544p+0, count * 0x1.0b4611a6p-34);
        const Difference<T> third(second.rounded, count * 0x1.3198a2e0p-69);
        const T rest = count * 0x1.b839a252049c1p-104 - (second.error + third.error);
        r = third.rounded - rest;
        tail = (third.rounded - r) - rest;
    }
};

// Minimax polynomials, relative to what they are added to 2e-17 and less.
template <class T>
[[gnu::always_inline]] inline T sine_of_rest(const T& r, const T& tail)
{
    constexpr double s[] = {-0x1.5555555555555p-3, 0x1.1111111110bb2p-7,   -0x1.a01a019e83816p-13,
                            0x1.71de379654304p-19, -0x1.ae600aca92c64p-26, 0x1.5e0b05bff20f2p-33};
    const T z = r * r;
    return r - ((0.5 * z * tail - tail) - z * r * polynomial(s, z));  // so that of -0 it is -0
}

template <class T>
[[gnu::always_inline]] inline T cosine_of_rest(const T& r, const T& tail)
{
    constexpr double c[] = {0x1.5555555555555p-5,   -0x1.6c16c16c16967p-10, 0x1.a01a019f4e9b4p-16,
                            -0x1.27e4fa17bf139p-22, 0x1.1eeb68cd22f56p-29,  -0x1.907d8f29fe831p-37};
    const T z = r * r, half = 0.5 * z, most = 1 - half;
    return most + (((1 - most) - half) + (z * z * polynomial(c, z) - r * tail));
}

// The sine of an angle and `quarters` quarter turns; |x| is at most most_angle.
template <class T>
[[gnu::always_inline]] inline T sine(const T& x, std::int64_t quarters)
{
    const Quarters<T> reduced(x);
    const auto n = reduced.n + quarters;
    const T of_sine = sine_of_rest(reduced.r, reduced.tail), of_cosine = cosine_of_rest(reduced.r, reduced.tail);
    const T value = (n & 1) != 0 ? of_cosine : of_sine;
    return (n & 2) != 0 ? -value : value;
}

template <class T>
[[gnu::always_inline]] inline T exponential(const T& x)
{
    constexpr double e[] = {0x1.5555555555556p-3,  0x1.5555555555555p-5,  0x1.11111111109a6p-7,  0x1.6c16c16c167dap-10,
                            0x1.a01a01a7cebcdp-13, 0x1.a01a01a48116fp-16, 0x1.71de0d85293b8p-19, 0x1.27e4e1dcf773bp-22,
                            0x1.af390ba7e6f47p-26, 0x1.1f6717774d5e0p-29};
    using Signed = typename Bits<T>::Signed;
    using Unsigned = typename Bits<T>::Unsigned;
    const T most = T{} + 710.0, least = T{} - 746.0;  // beyond them lie infinity and 0
    const T below = x > most ? most : x, within = below < least ? least : below;
    // x = k log 2 + r, with log 2 in 33 bits and a rest.
    const T biased = within * 0x1.71547652b82fep+0 + to_integer;
    const T count = biased - to_integer;
    const T high = within - count * 0x1.62e42fefp-1, low = count * 0x1.473de6af278edp-34;
    const T r = high - low, tail = (high - r) - low;
    const T value = 1 + (r + (tail + (0.5 * r * r + r * r * r * polynomial(e, r) + r * tail)));
    // Times 2^k, in two steps, as the last may be below the least normal number.
    const Unsigned both =
        std::bit_cast<Unsigned>(std::bit_cast<Signed>(biased) - std::bit_cast<std::int64_t>(to_integer) + 2046);
    const Unsigned first = both >> 1;
    return value * std::bit_cast<T>(first << 52) * std::bit_cast<T>((both - first) << 52);
}

}  // namespace elementary

double sine(double x);
double cosine(double x);
double exponential(double x);

struct SineAndCosine {
    double sine, cosine;
};
SineAndCosine sine_and_cosine(double x);

// The same of each lane.
Doubles sine(const Doubles& x);
Doubles cosine(const Doubles& x);
[[gnu::always_inline]] inline Doubles exponential(const Doubles& x)
{
    return by_registers(
        x, [](const Register& part) __attribute__((always_inline)) { return elementary::exponential(part); });
}

}  // namespace rapid

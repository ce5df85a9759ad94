// Numbers as unevaluated sums of two doubles, with twice the precision, for functions that round once at their end.
//
// The algorithms are those of Knuth (The Art of Computer Programming, 4.2.2) and Dekker (1971). None needs a fused
// multiply-add, so the results are bit-identical on every processor. T is a double or a vector of doubles.
#pragma once

#include <bit>
#include <cstdint>

namespace rapid {

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

}  // namespace rapid

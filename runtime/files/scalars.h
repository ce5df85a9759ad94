// Numbers in files.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace rapid {

enum class ByteOrder { Little, Big };
enum class ScalarType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Half, Float, Double };

// IEEE 754's binary16.
struct Half {
    std::uint16_t bits = 0;

    Half() = default;
    explicit Half(double value) : bits(Eigen::half(static_cast<float>(value)).x) {}
    operator float() const { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(bits)); }
};

constexpr std::size_t scalar_bytes(ScalarType type)
{
    constexpr std::size_t bytes[] = {1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
    return bytes[static_cast<std::size_t>(type)];
}

constexpr bool is_floating(ScalarType type) { return type >= ScalarType::Half; }

template <class Scalar>
Scalar load_scalar(const unsigned char* from, ByteOrder order)
{
    unsigned char bytes[sizeof(Scalar)];
    for (std::size_t b = 0; b < sizeof(Scalar); ++b)
        bytes[b] = order == ByteOrder::Little ? from[b] : from[sizeof(Scalar) - 1 - b];
    return std::bit_cast<Scalar>(bytes);
}

// Parses a number from text. Unlike std::from_chars, it accepts the sign of "+1", and rounds a float that is too small
// or too large for its type to 0 or infinity.
template <class Number>
std::from_chars_result parse_number(const char* begin, const char* end, Number& number)
{
    if (end - begin > 1 && *begin == '+' && begin[1] != '-') ++begin;
    std::from_chars_result parsed = std::from_chars(begin, end, number);
    if constexpr (std::is_same_v<Number, float>)
        if (double wide = 0; parsed.ec == std::errc::result_out_of_range) {
            parsed = std::from_chars(begin, end, wide);
            number = static_cast<float>(wide);
        }
    return parsed;
}

// Calls f with a value of the corresponding C++ type.
template <class F>
auto with_scalar(ScalarType type, const F& f)
{
    switch (type) {
        case ScalarType::Int8:
            return f(std::int8_t{});
        case ScalarType::UInt8:
            return f(std::uint8_t{});
        case ScalarType::Int16:
            return f(std::int16_t{});
        case ScalarType::UInt16:
            return f(std::uint16_t{});
        case ScalarType::Int32:
            return f(std::int32_t{});
        case ScalarType::UInt32:
            return f(std::uint32_t{});
        case ScalarType::Int64:
            return f(std::int64_t{});
        case ScalarType::UInt64:
            return f(std::uint64_t{});
        case ScalarType::Half:
            return f(Half{});
        case ScalarType::Float:
            return f(float{});
        case ScalarType::Double:
            break;
    }
    return f(double{});
}

}  // namespace rapid

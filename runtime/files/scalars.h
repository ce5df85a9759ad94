// Numbers in binary files.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace rapid {

enum class ByteOrder { Little, Big };
enum class ScalarType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float, Double };

constexpr std::size_t scalar_bytes(ScalarType type)
{
    constexpr std::size_t bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return bytes[static_cast<std::size_t>(type)];
}

constexpr bool is_floating(ScalarType type) { return type == ScalarType::Float || type == ScalarType::Double; }

template <class Scalar>
Scalar load_scalar(const unsigned char* from, ByteOrder order)
{
    unsigned char bytes[sizeof(Scalar)];
    for (std::size_t b = 0; b < sizeof(Scalar); ++b)
        bytes[b] = order == ByteOrder::Little ? from[b] : from[sizeof(Scalar) - 1 - b];
    return std::bit_cast<Scalar>(bytes);
}

// Calls f with a value of the C++ type.
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
        case ScalarType::Float:
            return f(float{});
        case ScalarType::Double:
            break;
    }
    return f(double{});
}

}  // namespace rapid

// Counter-based random numbers (Philox4x32-10, Salmon et al. 2011, Random123). A number depends only on its key and
// counter, not on earlier draws, the thread, or the machine.
#pragma once

#include <Random123/philox.h>

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace rapid {

// The random stream of a node, derived from (seed, name), so that inserting a node changes no other stream.
struct RandomKey {
    std::uint64_t value = 0;

    RandomKey() = default;
    RandomKey(std::uint64_t seed, std::string_view node)
    {
        std::uint64_t hash = 14695981039346656037ull;  // FNV-1a of the name, then mixed with the seed by Philox
        for (const char c : node) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
        r123::Philox4x32 philox;
        const auto mixed = philox({{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), 0, 0}},
                                  {{static_cast<std::uint32_t>(hash), static_cast<std::uint32_t>(hash >> 32)}});
        value = mixed[0] | std::uint64_t{mixed[1]} << 32;
    }
};

// Returns four independent numbers, uniform in [0, 1) with 32 bits each, for an item (the id of a point, the number of
// a birth) and a use (the quantity that they decide).
inline std::array<double, 4> uniform4(RandomKey key, std::uint64_t item, std::uint64_t use)
{
    r123::Philox4x32 philox;
    const auto bits = philox({{static_cast<std::uint32_t>(item), static_cast<std::uint32_t>(item >> 32),
                               static_cast<std::uint32_t>(use), static_cast<std::uint32_t>(use >> 32)}},
                             {{static_cast<std::uint32_t>(key.value), static_cast<std::uint32_t>(key.value >> 32)}});
    constexpr double unit = 1.0 / 4294967296.0;
    return {bits[0] * unit, bits[1] * unit, bits[2] * unit, bits[3] * unit};
}

// Computes the same for the items first, first + 1, ..., faster: out[i] is bit-identical to uniform4(key, first + i,
// use).
void uniform4(RandomKey key, std::uint64_t first, std::uint64_t use, std::span<std::array<double, 4>> out);

}  // namespace rapid

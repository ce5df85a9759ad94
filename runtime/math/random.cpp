#include "runtime/math/random.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "runtime/math/items.h"
#include "runtime/math/simd.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace rapid {
namespace {

// 32-bit numbers in 64-bit lanes, whose upper halves are ignored. As many as fit into a register, because wider vectors
// would go through memory between the products.
typedef std::uint64_t Wide __attribute__((vector_size(sizeof(Register))));
constexpr std::uint32_t width = sizeof(Register) / sizeof(double);

// Returns the low 32 bits of each lane times m. By itself g++ multiplies 64 by 64 bits, which takes three times as
// long.
[[gnu::always_inline]] inline Wide wide_product(const Wide& a, std::uint32_t m)
{
#if defined(__AVX512F__)
    return std::bit_cast<Wide>(_mm512_mul_epu32(std::bit_cast<__m512i>(a), _mm512_set1_epi64(m)));
#elif defined(__AVX2__)
    return std::bit_cast<Wide>(_mm256_mul_epu32(std::bit_cast<__m256i>(a), _mm256_set1_epi64x(m)));
#elif defined(__SSE2__)
    return std::bit_cast<Wide>(_mm_mul_epu32(std::bit_cast<__m128i>(a), _mm_set1_epi64x(m)));
#else
    return (a & 0xffffffffu) * (Wide{} + m);
#endif
}

[[gnu::always_inline]] inline Register as_reals(const Wide& a)
{
    // Sets the mantissa of 2^52 to the number, then subtracts 2^52.
    return std::bit_cast<Register>((a & 0xffffffffu) | std::bit_cast<std::uint64_t>(0x1p52)) - 0x1p52;
}

constexpr std::size_t packs = 2;  // interleaved, because each operation waits for the previous one

// The numbers of Philox4x32-10 for several items, before scaling.
struct Draw {
    Wide c0[packs], c1[packs], c2[packs], c3[packs];

    // items_of(p): the items of pack p.
    template <class Items>
    [[gnu::always_inline]] Draw(RandomKey key, const Items& items_of, std::uint64_t use)
    {
        for (std::size_t p = 0; p < packs; ++p) {
            c0[p] = items_of(p);
            c1[p] = c0[p] >> 32;
            c2[p] = Wide{} + use;
            c3[p] = c2[p] >> 32;
        }
        auto k0 = static_cast<std::uint32_t>(key.value), k1 = static_cast<std::uint32_t>(key.value >> 32);
        for (int round = 0; round < 10; ++round) {
            for (std::size_t p = 0; p < packs; ++p) {
                const Wide a = wide_product(c0[p], PHILOX_M4x32_0), b = wide_product(c2[p], PHILOX_M4x32_1);
                c0[p] = (b >> 32) ^ c1[p] ^ k0;
                c2[p] = (a >> 32) ^ c3[p] ^ k1;
                c1[p] = b;
                c3[p] = a;
            }
            k0 += PHILOX_W32_0;
            k1 += PHILOX_W32_1;
        }
    }
};

constexpr std::size_t at_once = packs * width;

// Supplies Draw with the items from `begin` on, one by one.
template <class Item>
[[gnu::always_inline]] inline auto one_by_one(const Item& item_at, std::size_t begin)
{
    return [&item_at, begin ](std::size_t p) __attribute__((always_inline))
    {
        Wide items;
        for (std::uint32_t l = 0; l < width; ++l) items[l] = item_at(begin + p * width + l);
        return items;
    };
}

template <class Item>
void draw(RandomKey key, const Item& item_at, std::uint64_t use, std::span<std::array<double, 4>> out)
{
    constexpr double unit = 1.0 / 4294967296.0;
    for (std::size_t begin = 0; begin < out.size(); begin += at_once) {
        const Draw drawn(key, one_by_one(item_at, begin), use);
        for (std::size_t p = 0; p < packs; ++p) {
            const std::size_t first = begin + p * width;
            if (first >= out.size()) break;
            const Register n0 = as_reals(drawn.c0[p]) * unit, n1 = as_reals(drawn.c1[p]) * unit,
                           n2 = as_reals(drawn.c2[p]) * unit, n3 = as_reals(drawn.c3[p]) * unit;
            const std::size_t n = std::min<std::size_t>(width, out.size() - first);
            for (std::size_t l = 0; l < n; ++l) out[first + l] = {n0[l], n1[l], n2[l], n3[l]};
        }
    }
}

}  // namespace

void uniform4(RandomKey key, std::uint64_t first, std::uint64_t use, std::span<std::array<double, 4>> out)
{
    draw(
        key, [first](std::size_t i) { return first + i; }, use, out);
}

void uniform4(RandomKey key, const Items& items, std::uint64_t use, std::span<std::array<double, 4>> out)
{
    if (items.are_consecutive()) return uniform4(key, items.first(), use, out);
    // Lanes after the last item repeat it.
    draw(
        key, [&](std::size_t i) { return items[std::min(i, out.size() - 1)]; }, use, out);
}

double uniform53(RandomKey key, std::uint64_t item, std::uint64_t use)
{
    const auto numbers = uniform4(key, item, use);
    const double sum = numbers[0] + numbers[1] * 0x1p-32;
    return sum < 1 ? sum : numbers[0];
}

void uniform53(RandomKey key, std::span<const std::uint64_t> items, std::uint64_t use, std::span<double> out)
{
    // Lanes after the last item repeat it.
    const auto item_at = [&](std::size_t i) { return items[std::min(i, items.size() - 1)]; };
    for (std::size_t begin = 0; begin < items.size(); begin += at_once) {
        const bool is_whole = begin + at_once <= items.size();
        const auto whole = [&](std::size_t p) __attribute__((always_inline))
        {
            Wide pack;
            std::memcpy(&pack, items.data() + begin + p * width, sizeof pack);
            return pack;
        };
        const Draw drawn = is_whole ? Draw(key, whole, use) : Draw(key, one_by_one(item_at, begin), use);
        for (std::size_t p = 0; p < packs; ++p) {
            const Register n0 = as_reals(drawn.c0[p]) * 0x1p-32, sum = n0 + as_reals(drawn.c1[p]) * 0x1p-64;
            const Register number = sum < 1.0 ? sum : n0;
            const std::size_t first = begin + p * width;
            if (is_whole) {
                std::memcpy(out.data() + first, &number, sizeof number);
                continue;
            }
            for (std::size_t i = first; i < std::min(first + width, items.size()); ++i) out[i] = number[i - first];
        }
    }
}

}  // namespace rapid

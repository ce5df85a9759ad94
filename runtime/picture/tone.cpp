#include "runtime/picture/tone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <tuple>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/math/simd.h"

namespace rapid {
namespace {

float srgb(float light) { return light <= 0.0031308f ? 12.92f * light : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f; }

float tone(float light) { return light < 0.8f ? light : 1 - 0.2f * std::exp(-(light - 0.8f) / 0.2f); }

// 255 srgb(tone(t²)) at equal steps of t up to 2, where it rounds to 255. Linear interpolation between them has an
// error of less than a fiftieth of a step of the dither.
constexpr int steps = 4096;
constexpr float max_root = 2;

const std::vector<float>& curve()
{
    static const std::vector<float> values = [] {
        std::vector<float> table(steps + 2);
        for (int i = 0; i < steps + 2; ++i) {
            const float t = max_root * static_cast<float>(i) / steps;
            table[static_cast<std::size_t>(i)] = 255 * srgb(tone(t * t));
        }
        return table;
    }();
    return values;
}

constexpr int dither_size = 8;  // pixels along both edges
constexpr int channels = 3;
using DitherRow = std::array<float, channels * dither_size>;  // all channels of a pixel have the same value

// Returns Bayer's thresholds for an ordered dither, from 1/128 to 127/128.
const std::array<DitherRow, dither_size>& thresholds()
{
    static const std::array<DitherRow, dither_size> values = [] {
        std::array<DitherRow, dither_size> table{};
        for (int y = 0; y < dither_size; ++y)
            for (int x = 0; x < dither_size; ++x) {
                int threshold = 0;
                for (int bit = 0; bit < 3; ++bit) {
                    const int a = x >> bit & 1, b = y >> bit & 1;
                    threshold |= ((a ^ b) << 1 | b) << (2 * (2 - bit));
                }
                std::fill_n(&table[y][channels * x], channels, (static_cast<float>(threshold) + 0.5f) / 64);
            }
        return table;
    }();
    return values;
}

// Writes the channels of dither_size pixels.
void write_block(const float* light, const DitherRow& dither, const float* table, std::uint8_t* rgb)
{
    typedef std::uint8_t Bytes __attribute__((vector_size(lanes)));
    for (std::size_t k = 0; k < dither.size(); k += lanes) {
        const Floats given = load_pack(light + k);
        Floats root, low, high;
        for (std::uint32_t l = 0; l < lanes; ++l) root[l] = std::sqrt(given[l]);
        // The comparison maps NaN to 0.
        const Floats at = (given > 0 ? (root > max_root ? Floats{} + max_root : root) : Floats{}) * (steps / max_root);
        const FloatFlags step = __builtin_convertvector(at, FloatFlags);
        for (std::uint32_t l = 0; l < lanes; ++l) low[l] = table[step[l]], high[l] = table[step[l] + 1];
        const Floats target = low + (at - __builtin_convertvector(step, Floats)) * (high - low);
        const Floats dithered = target + load_pack(dither.data() + k);
        const FloatFlags values = __builtin_convertvector(dithered > 255 ? Floats{} + 255 : dithered, FloatFlags);
        const Bytes bytes = __builtin_convertvector(values, Bytes);
        std::memcpy(rgb + k, &bytes, sizeof bytes);
    }
}

}  // namespace

std::uint8_t display_byte(float light)
{
    const float at = (light > 0 ? std::min(std::sqrt(light), max_root) : 0.0f) * (steps / max_root);
    const auto step = static_cast<std::size_t>(at);
    const float low = curve()[step], high = curve()[step + 1];
    return static_cast<std::uint8_t>(low + (at - static_cast<float>(step)) * (high - low) + 0.5f);
}

void write_pixels(std::span<const Vec3f> light, int x, int y, std::uint8_t* rgb)
{
    RAPID_ASSERT(x % dither_size == 0);
    const float* const table = curve().data();
    const DitherRow& dither = thresholds()[static_cast<std::size_t>(y % dither_size)];
    constexpr std::size_t block = std::tuple_size_v<DitherRow>;
    const float* from = light.data()->data();
    std::size_t left = channels * light.size();
    for (; left >= block; left -= block, from += block, rgb += block) write_block(from, dither, table, rgb);
    if (left == 0) return;
    std::array<float, block> rest{};
    std::copy_n(from, left, rest.begin());
    std::array<std::uint8_t, block> of_rest;
    write_block(rest.data(), dither, table, of_rest.data());
    std::copy_n(of_rest.begin(), left, rgb);
}

}  // namespace rapid

#include "runtime/picture/tone.h"

#include <array>
#include <cmath>
#include <vector>

namespace rapid {
namespace {

float srgb(float light) { return light <= 0.0031308f ? 12.92f * light : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f; }

float tone(float light) { return light < 0.8f ? light : 1 - 0.2f * std::exp(-(light - 0.8f) / 0.2f); }

// 255 srgb(tone(t²)) at even steps of t up to 2, where it is 255 to rounding. Between them it is interpolated, which is
// off by less than a fiftieth of a step of the dither.
constexpr int steps = 4096;
constexpr float most = 2;

const std::vector<float>& curve()
{
    static const std::vector<float> values = [] {
        std::vector<float> table(steps + 2);
        for (int i = 0; i < steps + 2; ++i) {
            const float t = most * static_cast<float>(i) / steps;
            table[static_cast<std::size_t>(i)] = 255 * srgb(tone(t * t));
        }
        return table;
    }();
    return values;
}

// Bayer's thresholds of an ordered dither, from 1/128 to 127/128.
const std::array<float, 64>& thresholds()
{
    static const std::array<float, 64> values = [] {
        std::array<float, 64> table{};
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) {
                int threshold = 0;
                for (int bit = 0; bit < 3; ++bit) {
                    const int a = x >> bit & 1, b = y >> bit & 1;
                    threshold |= ((a ^ b) << 1 | b) << (2 * (2 - bit));
                }
                table[static_cast<std::size_t>(8 * y + x)] = (static_cast<float>(threshold) + 0.5f) / 64;
            }
        return table;
    }();
    return values;
}

}  // namespace

void write_pixel(const Vec3f& light, int x, int y, std::uint8_t* rgb)
{
    static const float* const table = curve().data();
    static const std::array<float, 64>& dither = thresholds();
    const float threshold = dither[static_cast<std::size_t>(8 * (y & 7) + (x & 7))];
    for (int c = 0; c < 3; ++c) {
        // Written so that NaN becomes 0.
        const float t = light[c] > 0 ? std::min(std::sqrt(light[c]), most) : 0;
        const float at = t * (steps / most);
        const auto step = static_cast<int>(at);
        const float low = table[step], wanted = low + (at - static_cast<float>(step)) * (table[step + 1] - low);
        rgb[c] = static_cast<std::uint8_t>(std::min(wanted + threshold, 255.0f));
    }
}

}  // namespace rapid

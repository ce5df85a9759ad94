// Compares the bytes of a pixel with sRGB's formula.
#include "runtime/picture/tone.h"

#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "tests/test.h"

namespace rapid {
namespace {

constexpr int across = 8;  // pixels of the dither along both edges

// Returns the mean over the dither for a constant light, in byte steps.
double mean_of(float light)
{
    const std::vector<Vec3f> row(across, Vec3f::Constant(light));
    std::vector<std::uint8_t> bytes(3 * across);
    int sum = 0;
    for (int y = 0; y < across; ++y) {
        write_pixels(row, 0, y, bytes.data());
        sum = std::accumulate(bytes.begin(), bytes.end(), sum);
    }
    return sum / (3.0 * across * across);
}

double srgb(double light) { return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055; }

}  // namespace

TEST_CASE("a light up to 0.8 is in the mean its value in sRGB, to a step of the dither", "[picture][tone]")
{
    rc::prop("", [] {
        const auto light = static_cast<float>(*rc::gen::inRange(0, 800'001)) * 1e-6f;
        RC_ASSERT(std::abs(mean_of(light) - 255 * srgb(light)) <= 0.6 / 64);
    });
}

TEST_CASE("the byte of a light up to 0.8 without the dither is the nearest to sRGB", "[picture][tone]")
{
    rc::prop("", [] {
        const auto light = static_cast<float>(*rc::gen::inRange(0, 800'001)) * 1e-6f;
        RC_ASSERT(std::abs(display_byte(light) - 255 * srgb(light)) <= 0.5 + 0.6 / 64);
    });
    CHECK(display_byte(-1) == 0);
    CHECK(display_byte(std::numeric_limits<float>::quiet_NaN()) == 0);
    CHECK(display_byte(std::numeric_limits<float>::infinity()) == 255);
}

TEST_CASE("brighter light is compressed; zero, negative and undefined light is black", "[picture][tone]")
{
    CHECK(mean_of(0.8f) < mean_of(0.9f));
    CHECK(mean_of(0.9f) < mean_of(1.2f));
    CHECK(mean_of(1e6f) == 255);
    CHECK(mean_of(std::numeric_limits<float>::infinity()) == 255);
    for (const float none : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) CHECK(mean_of(none) == 0);
}

TEST_CASE("a pixel's bytes do not depend on how many are written together", "[picture][tone]")
{
    rc::prop("", [] {
        const int n = *rc::gen::inRange(1, 40), y = *rc::gen::inRange(0, across);
        std::vector<Vec3f> light;
        for (int k = 0; k < n; ++k) {
            const auto channel = [] { return static_cast<float>(*rc::gen::inRange(-100, 3000)) * 1e-3f; };
            light.emplace_back(channel(), channel(), channel());
        }
        std::vector<std::uint8_t> whole(3 * light.size());
        write_pixels(light, 0, y, whole.data());
        for (std::size_t first = 0; first < light.size(); first += across) {
            std::vector<std::uint8_t> alone(3);
            write_pixels(std::span(light).subspan(first, 1), static_cast<int>(first), y, alone.data());
            for (int c = 0; c < 3; ++c) RC_ASSERT(alone[c] == whole[3 * first + c]);
        }
    });
}

}  // namespace rapid

#include "runtime/picture/picture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "runtime/picture/discs.h"

namespace rapid {
namespace {

float srgb(float light) { return light <= 0.0031308f ? 12.92f * light : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f; }

// Unchanged up to 0.8; brighter light is compressed below 1 instead of being cut off.
float tone(float light) { return light < 0.8f ? light : 1 - 0.2f * std::exp(-(light - 0.8f) / 0.2f); }

// Bayer's dither thresholds, 0 to 63, against banding in dark gradients.
int bayer(int x, int y)
{
    int threshold = 0;
    for (int bit = 0; bit < 3; ++bit) {
        const int a = x >> bit & 1, b = y >> bit & 1;
        threshold |= ((a ^ b) << 1 | b) << (2 * (2 - bit));
    }
    return threshold;
}

std::uint8_t quantize(float light, int x, int y)
{
    const float wanted = 255 * srgb(tone(std::max(0.0f, light)));
    return static_cast<std::uint8_t>(
        std::clamp(std::floor(wanted + (static_cast<float>(bayer(x, y)) + 0.5f) / 64), 0.0f, 255.0f));
}

// Averages the samples of each pixel.
std::vector<Vec3f> resolve(const Surfaces& surfaces, int width, int height)
{
    std::vector<Vec3f> colours(static_cast<std::size_t>(width) * height);
    tbb::parallel_for(0, height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            Vec3f sum = Vec3f::Zero();
            for (int j = 0; j < surface_samples; ++j)
                for (int i = 0; i < surface_samples; ++i)
                    sum += surfaces.colour[static_cast<std::size_t>(y * surface_samples + j) * surfaces.width +
                                           x * surface_samples + i];
            colours[static_cast<std::size_t>(y) * width + x] = sum / (surface_samples * surface_samples);
        }
    });
    return colours;
}

}  // namespace

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view)
{
    const Light light(points, options, scene, view);
    const Surfaces surfaces = draw_surfaces(points, options, scene, view, light);
    const int width = options.width, height = options.height;
    std::vector<Vec3f> colours = resolve(surfaces, width, height);
    draw_points(points, options, view, light, surfaces, colours);

    Picture picture{width, height, std::vector<std::uint8_t>(3 * colours.size())};
    tbb::parallel_for(0, height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const std::size_t here = static_cast<std::size_t>(y) * width + x;
            for (int c = 0; c < 3; ++c) picture.rgb[3 * here + c] = quantize(colours[here][c], x, y);
        }
    });
    return picture;
}

}  // namespace rapid

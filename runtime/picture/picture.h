// Pictures of points: what an artist looks at first. Discs with soft edges and the shading of balls, nearest in front,
// over the shapes of the scene and a ground grid.
//
// The same bits for any number of threads. Works in linear light; colours are Cd where points have it, else the speed
// on a perceptual ramp; radii are pscale where it is large enough to see, else a few pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

// 8 bits a channel, sRGB, rows from the top; shape [height][width][3].
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;

    const std::uint8_t* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view);

}  // namespace rapid

// Pictures of points: discs with soft edges and the shading of balls, sorted by depth, over the shapes of the scene and
// a ground grid.
//
// The result is bit-identical for any number of threads. Works in linear light. Colours are Cd if points have it, else
// the speed on a perceptual ramp. Radii are pscale if that is large enough to see, else a few pixels. Alpha is the
// opacity.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/picture/scene.h"
#include "runtime/points/point_set.h"

namespace rapid {

// 8 bits per channel, sRGB, rows from the top; shape [height][width][3].
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;

    const std::uint8_t* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

// Draws the pictures of a sequence. The parts that stay the same are drawn once: backdrop, ground, shapes and their
// shadows, as long as neither the camera nor a shape moves. The result does not depend on this cache.
class Painter {
public:
    Painter();
    ~Painter();

    // scene: not null. The same object is assumed to be an unchanged scene.
    Picture draw(const PointSet& points, const PictureOptions& options,
                 const std::shared_ptr<const PictureScene>& scene, const PictureView& view);

private:
    struct StillLayer;
    std::unique_ptr<StillLayer> still_;
};

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view);

}  // namespace rapid

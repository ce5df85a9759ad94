// Pictures of points: what an artist looks at first. Discs with soft edges and the shading of balls, nearest in front,
// over the shapes of the scene and a ground grid.
//
// The same bits for any number of threads. Works in linear light; colours are Cd where points have it, else the speed
// on a perceptual ramp; radii are pscale where it is large enough to see, else a few pixels; Alpha is the opacity.
#pragma once

#include <cstdint>
#include <memory>
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

// Draws the pictures of a sequence. What does not change from one to the next is drawn once: backdrop, ground, shapes
// and the shadows that they cast, while neither the camera nor a shape moves. The bits do not depend on that.
class Painter {
public:
    Painter();
    ~Painter();

    // scene: not null. One that is the same object is taken to be the same scene.
    Picture draw(const PointSet& points, const PictureOptions& options,
                 const std::shared_ptr<const PictureScene>& scene, const PictureView& view);

private:
    struct StillLayer;
    std::unique_ptr<StillLayer> still_;
};

Picture render(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
               const PictureView& view);

}  // namespace rapid

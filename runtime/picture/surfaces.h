// The part of a picture that is not points: background, ground and the meshes of the scene.
#pragma once

#include <vector>

#include "runtime/picture/light.h"

namespace rapid {

// Samples along each edge of a pixel: surfaces are drawn that much larger, and averaged.
constexpr int surface_samples = 2;

// Linear colours and depths, shape [height][width] in samples.
struct Surfaces {
    int width, height;
    std::vector<Vec3f> colour;
    std::vector<float> depth;  // m; infinite where there is nothing
};

Surfaces draw_surfaces(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
                       const PictureView& view, const Light& light);

}  // namespace rapid

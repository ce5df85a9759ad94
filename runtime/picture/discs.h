// The points of a picture, as discs.
#pragma once

#include <vector>

#include "runtime/picture/surfaces.h"

namespace rapid {

// Draws the points over `picture`: linear colours, shape [height][width]. Nothing depends on the order in which threads
// work.
void draw_points(const PointSet& points, const PictureOptions& options, const PictureView& view, const Light& light,
                 const Surfaces& surfaces, std::vector<Vec3f>& picture);

}  // namespace rapid

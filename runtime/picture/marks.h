// The points of a picture, drawn as balls, as cards, or as streaks if they move during the exposure.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/picture/surfaces.h"

namespace rapid {

// A point in the picture. A streak covers a pixel by the fraction of the exposure that it spends in front of it.
struct Mark {
    float x, y, depth;     // at the end of the exposure; depth in m
    float radius;          // pixels; 0: not visible
    float metres;          // radius in world space
    float dx, dy, ddepth;  // displacement from there to the position at the start of the exposure
    float length;          // of (dx, dy); 0: at rest
    float opacity;         // 0 to 1
    Vec3f colour;
    bool additive;
    bool card;  // a flat disc; (dx, dy, ddepth) is then its normal: right, down, to the viewer
    bool line;  // a segment of a trail, which covers its whole length evenly
};

// Returns how much light each point blocks; shape [points.size()], or empty if all points are opaque. A colour brighter
// than white glows and blocks none.
std::vector<float> shadow_opacity(const PointSet& points, const PictureScene& scene);

// Marks in the order of the points, followed by the segments of their trails, and the marks that may be in each tile.
struct Marks {
    std::vector<Mark> all;
    std::vector<std::uint32_t> first;     // start of each tile's part of `of_tiles`, plus the end
    std::vector<std::uint64_t> of_tiles;  // a mark's index in `all`, below the bits of its depth as the sort key
};

Marks make_marks(const PointSet& points, const TileGrid& tiles, const PictureScene& scene, const PictureView& view,
                 const Light& light);

// Draws the marks of a tile over `colour`, shape [tile_size][tile_size], front to back. Of two marks at the same depth,
// the first in the set is in front.
void draw_marks(const Marks& marks, const TileGrid& tiles, int tile, const SurfaceTile& surfaces, const Lens& lens,
                const Light& light, std::span<Vec3f> colour);

}  // namespace rapid

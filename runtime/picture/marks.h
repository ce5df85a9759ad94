// The points of a picture, as discs, or as streaks where they move while it is exposed.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/picture/surfaces.h"

namespace rapid {

// A point in the picture. It is the time that it is before a pixel by which it covers that.
struct Mark {
    float x, y, depth;     // at the end of the exposure; depth in m
    float radius;          // pixels; 0: not seen
    float metres;          // radius in the scene
    float dx, dy, ddepth;  // from there to where it was at the beginning
    float length;          // of dx, dy; 0: it stays
    float opacity;         // 0 to 1
    Vec3f colour;
    bool additive;
    bool line;  // a piece of a trail, which covers all of the way alike
};

// By how much points take light from what is behind them; shape [points.size()], or empty: they are all opaque. A
// colour brighter than white shines, and takes none.
std::vector<float> shadow_opacity(const PointSet& points, const PictureScene& scene);

// Marks in the order of the points, then the pieces of their trails, and which may be in which tile.
struct Marks {
    std::vector<Mark> all;
    std::vector<std::uint32_t> first;     // of each tile's in `of_tiles`, and the end
    std::vector<std::uint64_t> of_tiles;  // a mark's place in `all`, and above it the bits of its depth, to sort by
};

Marks make_marks(const PointSet& points, const TileGrid& tiles, const PictureScene& scene, const PictureView& view,
                 const Light& light);

// Draws the marks of a tile over `colour`, shape [tile_size][tile_size], front to back: of two at the same depth the
// earlier in the set is in front.
void draw_marks(const Marks& marks, const TileGrid& tiles, int tile, const SurfaceTile& surfaces, const Lens& lens,
                const Light& light, std::span<Vec3f> colour);

}  // namespace rapid

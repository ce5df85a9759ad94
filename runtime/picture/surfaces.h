// The part of a picture without points: background, ground and the meshes of the scene. It is drawn once per view and
// set of shapes. Each frame adds the shadows of its points.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "runtime/picture/light.h"

namespace rapid {

// Samples along each edge of a pixel: surfaces are drawn that much larger and averaged.
constexpr int surface_samples = 2;

// The picture is drawn in square tiles, each by one thread.
constexpr int tile_size = 32;  // pixels
constexpr int tile_pixels = tile_size * tile_size;

// The tiles of a picture, row by row from the top. Those at the right and lower edge may be cut.
struct TileGrid {
    int width, height;  // size of the picture
    int across = (width + tile_size - 1) / tile_size, down = (height + tile_size - 1) / tile_size;

    int count() const { return across * down; }
    int left(int tile) const { return tile % across * tile_size; }
    int top(int tile) const { return tile / across * tile_size; }
    int right(int tile) const { return std::min(left(tile) + tile_size, width); }
    int bottom(int tile) const { return std::min(top(tile) + tile_size, height); }
};

struct SurfaceTile {
    std::vector<Vec3f> colour;        // linear, without shadows of points; shape [tile_size][tile_size]
    std::vector<std::uint8_t> bytes;  // the same as bytes of the picture: three per pixel

    // m; shape [tile_pixels][samples of a pixel]; empty if there are no surfaces.
    std::vector<float> depth;
    float nearest, farthest;  // extremes of `depth`

    // Light that points can take from a pixel, and its position in their shadow grid. A pixel on an edge has several
    // entries.
    struct Lit {
        std::uint32_t pixel;
        Vec3f lamp, cell;
    };
    std::vector<Lit> lit;
    Box3f cells;  // bounds of the positions in the shadow grid
};

// Returns the memory of the tiles per pixel. With colliders, it applies to a pixel that shows one and that the lamp may
// reach.
constexpr double surface_bytes_per_pixel(bool colliders)
{
    constexpr double open = sizeof(Vec3f) + 3;
    constexpr double covered = surface_samples * surface_samples * sizeof(float) + sizeof(SurfaceTile::Lit);
    return colliders ? open + covered : open;
}

// Draws the tiles of the picture.
std::vector<SurfaceTile> draw_surfaces(const PictureOptions& options, const PictureScene& scene,
                                       const PictureView& view, const Light& light);

// The shading of a visible surface point.
struct ShadedSample {
    Vec3f colour;  // without shadows of points
    Vec3f lamp;    // the part of it that points can shade
};

// Lines on a ground plane that fade out with distance from the scene.
struct Ground {
    Vec3f normal, u, v;
    float offset;
    float spacing;  // m
    Vec3f scene_center;
    Vec3f center;  // centre of the visible part
    float extent;  // m from `center`, where lines have faded to 1/e
    bool solid;

    Ground(const PictureScene::Plane& plane, const PictureView& view, bool is_solid);

    // Returns the ray parameter at the plane, or infinity if the ray misses it.
    float depth(const Vec3f& origin, const Vec3f& ray) const
    {
        const float towards = normal.dot(ray);
        const float t = (offset - normal.dot(origin)) / towards;
        return towards != 0 && t > 0 && std::isfinite(t) ? t : std::numeric_limits<float>::infinity();
    }

    // Returns true if the plane is seen from behind and stands between the eye and the scene. It is then not drawn.
    bool hides_scene(const Vec3f& eye) const { return normal.dot(eye) < offset && normal.dot(scene_center) >= offset; }

    // Shades P, at depth t on the ray, over the background.
    ShadedSample shade(const Vec3f& P, float t, float focal, const Vec3f& ray, const Vec3f& background,
                       const Light& light) const;

private:
    float line(float x, float pixel) const;
};

}  // namespace rapid

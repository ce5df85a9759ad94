// Points are sorted into tiles; each tile sorts its own by depth and composites them front to back, until a pixel is
// covered. A tile's points come in the order of their depth, and of their place in the set where depths are equal.
#include "runtime/picture/discs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "runtime/parallel.h"

namespace rapid {
namespace {

constexpr int tile_size = 32;  // pixels

// Dark blue over teal to light yellow: lightness grows evenly with speed, and stands out on the background all along.
// sRGB, at even steps.
constexpr std::array<std::array<float, 3>, 6> speed_ramp = {{{0.17f, 0.25f, 0.62f},
                                                             {0.16f, 0.42f, 0.80f},
                                                             {0.18f, 0.62f, 0.82f},
                                                             {0.38f, 0.79f, 0.75f},
                                                             {0.72f, 0.91f, 0.66f},
                                                             {1.00f, 0.97f, 0.74f}}};

float linear(float srgb) { return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f); }

// The ramp in linear light, finer than 8 bits can show.
const std::vector<Vec3f>& speed_colours()
{
    static const std::vector<Vec3f> colours = [] {
        std::vector<Vec3f> table(1024);
        for (std::size_t i = 0; i < table.size(); ++i) {
            const float at = static_cast<float>(i) / static_cast<float>(table.size() - 1) * (speed_ramp.size() - 1);
            const std::size_t step = std::min<std::size_t>(static_cast<std::size_t>(at), speed_ramp.size() - 2);
            const float t = at - static_cast<float>(step);
            for (int c = 0; c < 3; ++c)
                table[i][c] = linear((1 - t) * speed_ramp[step][c] + t * speed_ramp[step + 1][c]);
        }
        return table;
    }();
    return colours;
}

// A point in the picture.
struct Disc {
    float x, y, depth;
    float radius;  // pixels
    float metres;  // radius in the scene
    Vec3f colour;
};

// How points look in this picture.
struct PointLook {
    const PointSet& points;
    const PictureView& view;
    const Light& light;
    Lens lens;
    int width, height;
    float far;  // m, the depth at which colours have faded halfway to the background

    Vec3f colour(std::size_t i) const
    {
        if (const Column<Vec3f>* Cd = points.find<Vec3f>("Cd")) {
            const Vec3f c = (*Cd)[i].cwiseMax(0.0f).cwiseMin(1e4f);
            if (c.allFinite()) return c;
        }
        const float speed = points.v()[i].norm() / static_cast<float>(view.full_speed);
        const std::vector<Vec3f>& table = speed_colours();
        // A square root: most points are slow, and differences among them show.
        const float at = std::isfinite(speed) ? std::sqrt(std::clamp(speed, 0.0f, 1.0f)) : 1;
        return table[static_cast<std::size_t>(at * static_cast<float>(table.size() - 1))];
    }

    // A radius of 0: not seen.
    Disc disc(std::size_t i) const
    {
        Disc d{};
        const Vec3f P = points.P()[i];
        const Vec3f s = lens.project(P);
        if (!s.allFinite() || s.z() < 1e-3f * far) return d;
        const Column<float>* pscale = points.find<float>("pscale");
        d.metres = pscale && (*pscale)[i] > 0 ? (*pscale)[i] : 0;
        const float least = static_cast<float>(view.least_radius);
        const float radius =
            std::min(std::max(least, d.metres * lens.focal / s.z()), 0.5f * static_cast<float>(height));
        const float reach = radius + 0.5f;
        if (!(s.x() + reach > 0 && s.y() + reach > 0 && s.x() - reach < static_cast<float>(width) &&
              s.y() - reach < static_cast<float>(height)))
            return d;
        d.x = s.x();
        d.y = s.y();
        d.depth = s.z();
        d.radius = radius;
        const float lamp = light.past_meshes(P, Vec3f::Zero()) * light.past_points(P);
        const float fog = std::exp(-0.35f * std::max(0.0f, s.z() / far - 1));
        const Vec3f own = colour(i);
        // A colour brighter than white glows, and no shadow dims it.
        const float glow = std::clamp(own.maxCoeff() - 1, 0.0f, 1.0f);
        const float lit = 0.30f + 0.80f * lamp;
        d.colour = own * ((lit + glow * (1 - lit)) * fog);
        return d;
    }
};

struct Tiles {
    int across, down;
    std::vector<Disc> discs;            // all, by point
    std::vector<std::uint32_t> first;   // of each tile's points in `points`, and the end
    std::vector<std::uint32_t> points;  // a tile's points in the order of the set

    template <class F>
    void for_each_tile_of(const Disc& d, const F& f) const
    {
        const float reach = d.radius + 0.5f;
        const auto tile = [](float at, int count) {
            return std::clamp(static_cast<int>(std::floor(at / tile_size)), 0, count - 1);
        };
        for (int j = tile(d.y - reach, down); j <= tile(d.y + reach, down); ++j)
            for (int i = tile(d.x - reach, across); i <= tile(d.x + reach, across); ++i) f(j * across + i);
    }
};

// A counting sort in two passes over blocks of points: each block has its own range in every tile.
Tiles sort_into_tiles(const PointLook& look)
{
    Tiles tiles{(look.width + tile_size - 1) / tile_size, (look.height + tile_size - 1) / tile_size, {}, {}, {}};
    const std::size_t n = look.points.size(), count = static_cast<std::size_t>(tiles.across * tiles.down);
    tiles.discs.resize(n);
    constexpr std::size_t block = 16 * chunk_size;
    const std::size_t blocks = (n + block - 1) / block;
    std::vector<std::vector<std::uint32_t>> next_in(blocks, std::vector<std::uint32_t>(count, 0));
    const auto for_each_block = [&](const auto& f) {
        tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
            for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i) f(i, next_in[b]);
        });
    };
    for_each_block([&](std::size_t i, std::vector<std::uint32_t>& counts) {
        tiles.discs[i] = look.disc(i);
        if (tiles.discs[i].radius > 0) tiles.for_each_tile_of(tiles.discs[i], [&](int t) { ++counts[t]; });
    });
    std::uint32_t total = 0;
    for (std::size_t t = 0; t < count; ++t) {
        tiles.first.push_back(total);
        for (std::size_t b = 0; b < blocks; ++b) total += std::exchange(next_in[b][t], total);
    }
    tiles.first.push_back(total);
    tiles.points.resize(total);
    for_each_block([&](std::size_t i, std::vector<std::uint32_t>& next) {
        if (tiles.discs[i].radius > 0)
            tiles.for_each_tile_of(tiles.discs[i],
                                   [&](int t) { tiles.points[next[t]++] = static_cast<std::uint32_t>(i); });
    });
    return tiles;
}

// A pixel while points are composited front to back.
struct Pixel {
    Vec3f colour = Vec3f::Zero();
    float open = 1;  // transmittance: the part of what is behind that shows
};

class TilePainter {
public:
    TilePainter(const PointLook& look, const Tiles& tiles, const Surfaces& surfaces, std::vector<Vec3f>& picture)
        : look_(look), tiles_(tiles), surfaces_(surfaces), picture_(picture)
    {
    }

    void paint(int tile) const
    {
        const int x0 = tile % tiles_.across * tile_size, y0 = tile / tiles_.across * tile_size;
        const int x1 = std::min(x0 + tile_size, look_.width), y1 = std::min(y0 + tile_size, look_.height);
        std::vector<std::uint32_t> order(tiles_.points.begin() + tiles_.first[tile],
                                         tiles_.points.begin() + tiles_.first[tile + 1]);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            const float da = tiles_.discs[a].depth, db = tiles_.discs[b].depth;
            return da != db ? da < db : a < b;
        });
        std::array<Pixel, tile_size * tile_size> pixels;
        for (const std::uint32_t point : order) composite(tiles_.discs[point], x0, y0, x1, y1, pixels);
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
                const Pixel& pixel = pixels[static_cast<std::size_t>((y - y0) * tile_size + x - x0)];
                Vec3f& out = picture_[static_cast<std::size_t>(y) * look_.width + x];
                out = pixel.colour + pixel.open * out;
            }
    }

private:
    // The part of the pixel's samples that no surface nearer than `depth` hides.
    float past_surfaces(int x, int y, float depth) const
    {
        int past = 0;
        for (int j = 0; j < surface_samples; ++j)
            for (int i = 0; i < surface_samples; ++i) {
                const std::size_t sample =
                    static_cast<std::size_t>(y * surface_samples + j) * surfaces_.width + x * surface_samples + i;
                past += surfaces_.depth[sample] > depth;
            }
        return static_cast<float>(past) / (surface_samples * surface_samples);
    }

    void composite(const Disc& d, int x0, int y0, int x1, int y1,
                   std::array<Pixel, tile_size * tile_size>& pixels) const
    {
        const float reach = d.radius + 0.5f;
        const int left = std::max(x0, static_cast<int>(std::floor(d.x - reach)));
        const int right = std::min(x1, static_cast<int>(std::ceil(d.x + reach)));
        const int top = std::max(y0, static_cast<int>(std::floor(d.y - reach)));
        const int bottom = std::min(y1, static_cast<int>(std::ceil(d.y + reach)));
        // Only discs of a few pixels are shaded as balls.
        const float roundness = std::clamp((d.radius - 1.2f) / 2.5f, 0.0f, 1.0f);
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < right; ++x) {
                Pixel& pixel = pixels[static_cast<std::size_t>((y - y0) * tile_size + x - x0)];
                if (pixel.open < 1.0f / 512) continue;
                const float dx = static_cast<float>(x) + 0.5f - d.x, dy = static_cast<float>(y) + 0.5f - d.y;
                const float away = std::sqrt(dx * dx + dy * dy);
                float cover = std::clamp(reach - away, 0.0f, 1.0f);
                if (cover == 0) continue;
                // The ball's surface is nearer than its centre.
                const float edge = std::min(1.0f, away / d.radius);
                const float bulge = std::sqrt(1 - edge * edge);
                cover *= past_surfaces(x, y, d.depth - bulge * d.metres);
                const Vec3f lit = d.colour * (0.85f + roundness * (shade(dx / d.radius, dy / d.radius, bulge) - 0.85f));
                pixel.colour += pixel.open * cover * lit;
                pixel.open *= 1 - cover;
            }
    }

    // Of a ball, where its normal in the view is (nx right, ny down, nz to the viewer).
    float shade(float nx, float ny, float nz) const
    {
        const Vec3f n = look_.lens.right * nx - look_.lens.up * ny - look_.lens.forward * nz;
        const float lamp = 0.5f + 0.5f * n.dot(look_.light.direction());
        return 0.25f + 0.95f * lamp * lamp;
    }

    const PointLook& look_;
    const Tiles& tiles_;
    const Surfaces& surfaces_;
    std::vector<Vec3f>& picture_;
};

}  // namespace

void draw_points(const PointSet& points, const PictureOptions& options, const PictureView& view, const Light& light,
                 const Surfaces& surfaces, std::vector<Vec3f>& picture)
{
    const int width = options.width, height = options.height;
    const float far = static_cast<float>((view.camera.target - view.camera.position).norm());
    const PointLook look{points, view, light, Lens::of_camera(view.camera, width, height), width, height, far};
    const Tiles tiles = sort_into_tiles(look);
    const TilePainter painter(look, tiles, surfaces, picture);
    tbb::parallel_for(0, tiles.across * tiles.down, [&](int tile) { painter.paint(tile); });
}

}  // namespace rapid

// Points are sorted into tiles. Each tile sorts its points by depth and composites them front to back, until a pixel is
// opaque.
#include "runtime/picture/marks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"
#include "runtime/points/members.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

// From dark blue over teal to light yellow: lightness grows evenly with speed and contrasts with the background
// everywhere. sRGB, in equal steps.
constexpr std::array<std::array<float, 3>, 6> speed_ramp = {{{0.17f, 0.25f, 0.62f},
                                                             {0.16f, 0.42f, 0.80f},
                                                             {0.18f, 0.62f, 0.82f},
                                                             {0.38f, 0.79f, 0.75f},
                                                             {0.72f, 0.91f, 0.66f},
                                                             {1.00f, 0.97f, 0.74f}}};

float linear(float srgb) { return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f); }

// Returns the ramp in linear light, finer than 8 bits can show.
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

// The styles of a scene, resolved for each point.
class PointStyles {
public:
    PointStyles(const PointSet& points, const PictureScene& scene) : styles_(scene.styles)
    {
        for (std::size_t k = 0; k < styles_.size(); ++k) {
            const Strided<std::uint8_t> members = members_of(points, styles_[k].group);
            const auto apply_to = [&](std::vector<std::uint8_t>& of_points) {
                of_points.resize(points.size(), 0);
                for (std::size_t i = 0; i < of_points.size(); ++i)
                    if (members[i]) of_points[i] = static_cast<std::uint8_t>(k + 1);
            };
            if (styles_[k].additive) apply_to(additive_);
            if (styles_[k].cards) apply_to(cards_);
            if (styles_[k].shutter) apply_to(shutter_);
        }
    }

    bool is_additive(std::size_t i) const
    {
        return !additive_.empty() && additive_[i] != 0 && *styles_[additive_[i] - 1].additive;
    }
    bool is_card(std::size_t i) const { return !cards_.empty() && cards_[i] != 0 && *styles_[cards_[i] - 1].cards; }
    // Returns the exposure time in s.
    double shutter(std::size_t i) const
    {
        return shutter_.empty() || shutter_[i] == 0 ? 0 : *styles_[shutter_[i] - 1].shutter;
    }

private:
    const std::vector<PointStyle>& styles_;
    // The style that applies to each point: its index in styles_ plus 1, or 0 for none. Empty if no point has one.
    std::vector<std::uint8_t> additive_, cards_, shutter_;
};

// Returns how much brighter than white a colour is, at most 1.
float glow(const Vec3f& colour) { return std::clamp(colour.maxCoeff() - 1, 0.0f, 1.0f); }

float opacity_of(const Column<float>* Alpha, std::size_t i)
{
    if (!Alpha) return 1;
    const float alpha = (*Alpha)[i];
    return alpha >= 0 ? std::min(alpha, 1.0f) : 0;  // NaN gives 0
}

// The appearance of points in this picture.
struct PointLook {
    const PictureView& view;
    const Light& light;
    const TileGrid& tiles;
    Lens lens;
    float far;  // m, depth at which colours have faded halfway to the background
    PointStyles styles;
    const Strided<Vec3f> P, v;
    const Column<Vec3f>* Cd;
    const Column<float>*Alpha, *pscale, *age;
    const Column<Quatf>* orient;
    Trails trails;

    PointLook(const PointSet& drawn, const TileGrid& grid, const PictureScene& in, const PictureView& from,
              const Light& lit)
        : view(from),
          light(lit),
          tiles(grid),
          lens(Lens::of_camera(from.camera, grid.width, grid.height)),
          far(static_cast<float>((from.camera.target - from.camera.position).norm())),
          styles(drawn, in),
          P(drawn.P().read()),
          v(drawn.v().read()),
          Cd(drawn.find<Vec3f>("Cd")),
          Alpha(drawn.find<float>("Alpha")),
          pscale(drawn.find<float>("pscale")),
          age(drawn.find<float>("age")),
          orient(drawn.find<Quatf>("orient")),
          trails(drawn)
    {
    }

    Vec3f colour(std::size_t i) const
    {
        if (Cd) {
            const Vec3f c = (*Cd)[i].cwiseMax(0.0f).cwiseMin(1e4f);
            if (c.allFinite()) return c;
        }
        const float speed = v[i].norm() / static_cast<float>(view.full_speed);
        const std::vector<Vec3f>& table = speed_colours();
        // The square root shows differences among slow points, which are the most frequent.
        const float at = std::isfinite(speed) ? std::sqrt(std::clamp(speed, 0.0f, 1.0f)) : 1;
        return table[static_cast<std::size_t>(at * static_cast<float>(table.size() - 1))];
    }

    // Returns segment k of the trail, from 1, between its positions k - 1 and k. Segments fade towards the end.
    Mark piece(std::size_t i, int k, Mark m) const
    {
        m.radius = 0;
        if (k > trails.count(i)) return m;
        const Vec3f from = lens.project(trails.at(i, k - 1)), to = lens.project(trails.at(i, k));
        if (!from.allFinite() || !to.allFinite() || std::min(from.z(), to.z()) < 1e-3f * far) return m;
        m.x = from.x();
        m.y = from.y();
        m.depth = from.z();
        m.dx = to.x() - from.x();
        m.dy = to.y() - from.y();
        m.ddepth = to.z() - from.z();
        m.length = std::hypot(m.dx, m.dy);
        m.opacity *= 1 - (static_cast<float>(k) - 0.5f) / static_cast<float>(trails.places());
        m.line = true;
        if (m.length > 0 && m.length < static_cast<float>(tiles.width + tiles.height)) size(m);
        return m;
    }

    // Sets the radius if the mark may be in the picture.
    void size(Mark& m) const
    {
        const auto least = static_cast<float>(view.min_radius);
        const auto width = static_cast<float>(tiles.width), height = static_cast<float>(tiles.height);
        const float radius = std::min(std::max(least, m.metres * lens.focal / m.depth), 0.5f * height);
        const float reach = radius + 0.5f;
        if (m.x + std::max(0.0f, m.dx) + reach > 0 && m.y + std::max(0.0f, m.dy) + reach > 0 &&
            m.x + std::min(0.0f, m.dx) - reach < width && m.y + std::min(0.0f, m.dy) - reach < height)
            m.radius = radius;
    }

    // Sets the displacement back to the position when the shutter opened, or to the birth if that was later.
    void expose(std::size_t i, float shutter, Mark& m) const
    {
        const float open = std::min(shutter, age ? std::max(0.0f, (*age)[i]) : shutter);
        const Vec3f before = lens.project(P[i] - open * v[i]);
        if (!before.allFinite() || before.z() < 1e-3f * far) return;
        const float dx = before.x() - m.x, dy = before.y() - m.y, length = std::hypot(dx, dy);
        constexpr float shortest = 0.5f;  // pixels
        const auto longest = static_cast<float>(tiles.width + tiles.height);
        if (!(length > shortest && length < longest)) return;
        m.dx = dx;
        m.dy = dy;
        m.ddepth = before.z() - m.depth;
        m.length = length;
    }

    // Makes the mark a card, seen from its front or its back.
    void turn(const Quatf& by, Mark& m) const
    {
        constexpr float least = 0.02f;  // of the normal towards the viewer: a card seen from its edge is a line
        Vec3f n = by * Vec3f::UnitY();
        if (!n.allFinite()) return;
        if (n.dot(lens.forward) > 0) n = -n;
        m.card = true;
        m.dx = n.dot(lens.right);
        m.dy = -n.dot(lens.up);
        m.ddepth = std::max(least, -n.dot(lens.forward));
    }

    Mark mark(std::size_t i) const
    {
        Mark m{};
        const Vec3f s = lens.project(P[i]);
        if (!s.allFinite() || s.z() < 1e-3f * far) return m;
        m.opacity = opacity_of(Alpha, i);
        if (m.opacity == 0) return m;
        m.x = s.x();
        m.y = s.y();
        m.depth = s.z();
        m.metres = pscale && (*pscale)[i] > 0 ? (*pscale)[i] : 0;
        if (const double shutter = styles.shutter(i); shutter > 0) expose(i, static_cast<float>(shutter), m);
        size(m);
        if (m.radius == 0 && trails.count(i) == 0) return m;
        m.additive = styles.is_additive(i);
        if (m.length == 0 && orient && styles.is_card(i)) turn((*orient)[i], m);
        const float fog = std::exp(-0.35f * std::max(0.0f, s.z() / far - 1));
        const Vec3f own = colour(i);
        m.colour = own * fog;
        // A colour brighter than white glows and receives no shadow.
        const float shining = m.additive ? 1 : glow(own);
        if (shining < 1) {
            const float lamp = light.mesh_transmittance(P[i], Vec3f::Zero()) *
                               light.transmittance_of_others(P[i], m.metres, (1 - shining) * m.opacity);
            const float lit = 0.30f + 0.80f * lamp;
            m.colour *= lit + shining * (1 - lit);
        }
        return m;
    }
};

template <class F>
void for_each_tile_of(const Mark& m, const TileGrid& tiles, const F& f)
{
    const float reach = m.radius + 0.5f;
    const auto tile = [](float at, int count) {
        return static_cast<int>(std::clamp(std::floor(at / tile_size), 0.0f, static_cast<float>(count - 1)));
    };
    const float left = m.x + std::min(0.0f, m.dx) - reach, right = m.x + std::max(0.0f, m.dx) + reach;
    const float top = m.y + std::min(0.0f, m.dy) - reach, bottom = m.y + std::max(0.0f, m.dy) + reach;
    for (int j = tile(top, tiles.down); j <= tile(bottom, tiles.down); ++j)
        for (int i = tile(left, tiles.across); i <= tile(right, tiles.across); ++i) f(j * tiles.across + i);
}

// A pixel while points are composited front to back.
struct Pixel {
    Vec3f colour = Vec3f::Zero();
    float open = 1;  // transmittance: fraction of the background that shows
};

class TilePainter {
public:
    TilePainter(const TileGrid& tiles, int tile, const SurfaceTile& surfaces, const Lens& lens, const Light& light)
        : surfaces_(surfaces),
          lens_(lens),
          light_(light),
          x0_(tiles.left(tile)),
          y0_(tiles.top(tile)),
          x1_(tiles.right(tile)),
          y1_(tiles.bottom(tile))
    {
    }

    void composite(const Mark& m)
    {
        // For most marks the depth range of the tile shows that no surface hides them.
        const float first = m.depth + std::min(0.0f, m.ddepth) - m.metres;
        const float last = m.depth + std::max(0.0f, m.ddepth);
        if (surfaces_.farthest <= first) return;
        const bool hidden = surfaces_.nearest <= last;
        if (m.line)
            hidden ? line<true>(m) : line<false>(m);
        else if (m.card)
            hidden ? card<true>(m) : card<false>(m);
        else if (m.length > 0)
            hidden ? streak<true>(m) : streak<false>(m);
        else
            hidden ? disc<true>(m) : disc<false>(m);
    }

    void finish(std::span<Vec3f> colour) const
    {
        for (std::size_t i = 0; i < pixels_.size(); ++i) colour[i] = pixels_[i].colour + pixels_[i].open * colour[i];
    }

private:
    // Calls f(pixel, index in the tile, x and y from the mark to the pixel's centre) for the pixels in a box around the
    // mark.
    template <class F>
    void for_each_pixel(const Mark& m, const F& f)
    {
        const float reach = m.radius + 0.5f;
        const auto clamped = [](float at, int low, int high) {
            return static_cast<int>(std::clamp(at, static_cast<float>(low), static_cast<float>(high)));
        };
        const int left = clamped(std::floor(m.x + std::min(0.0f, m.dx) - reach), x0_, x1_);
        const int right = clamped(std::ceil(m.x + std::max(0.0f, m.dx) + reach), x0_, x1_);
        const int top = clamped(std::floor(m.y + std::min(0.0f, m.dy) - reach), y0_, y1_);
        const int bottom = clamped(std::ceil(m.y + std::max(0.0f, m.dy) + reach), y0_, y1_);
        for (int y = top; y < bottom; ++y)
            for (int x = left; x < right; ++x) {
                const auto offset = static_cast<std::size_t>((y - y0_) * tile_size + x - x0_);
                Pixel& pixel = pixels_[offset];
                if (pixel.open < 1.0f / 512) continue;
                f(pixel, offset, static_cast<float>(x) + 0.5f - m.x, static_cast<float>(y) + 0.5f - m.y);
            }
    }

    // Returns the fraction of the pixel's samples that no surface nearer than `depth` hides.
    float visible_fraction(std::size_t pixel, float depth) const
    {
        // Uses a vector, because g++ would branch at each sample.
        constexpr int samples = surface_samples * surface_samples;
        static_assert(samples == 4);
        typedef float Depths __attribute__((vector_size(samples * sizeof(float))));
        Depths of_pixel;
        std::memcpy(&of_pixel, &surfaces_.depth[samples * pixel], sizeof of_pixel);
        const auto past = of_pixel > depth;  // -1 or 0
        return static_cast<float>(-(past[0] + past[1] + past[2] + past[3])) / samples;
    }

    static void add(Pixel& pixel, const Mark& m, float cover, const Vec3f& colour)
    {
        pixel.colour += pixel.open * cover * colour;
        if (!m.additive) pixel.open *= 1 - cover;
    }

    // Returns how round a mark is shaded. Only discs of several pixels are shaded as balls.
    static float roundness_of(const Mark& m)
    {
        return m.additive ? 0 : std::clamp((m.radius - 1.2f) / 2.5f, 0.0f, 1.0f);
    }

    // hidden: surfaces may hide parts of it.
    template <bool hidden>
    void disc(const Mark& m)
    {
        const float reach = m.radius + 0.5f, inverse = 1 / m.radius;
        const float roundness = roundness_of(m);
        const Vec3f flat = m.additive ? m.colour : Vec3f(0.85f * m.colour);
        for_each_pixel(m, [&](Pixel& pixel, std::size_t offset, float dx, float dy) {
            const float squared = dx * dx + dy * dy;
            if (squared >= reach * reach) return;
            const float away = std::sqrt(squared);
            float cover = m.opacity * std::min(reach - away, 1.0f);
            // The surface of the ball is nearer than its centre.
            const float edge = std::min(1.0f, away * inverse);
            const float bulge = std::sqrt(1 - edge * edge);
            if constexpr (hidden) cover *= visible_fraction(offset, m.depth - bulge * m.metres);
            if (roundness == 0) return add(pixel, m, cover, flat);
            const float shaded = shade(dx * inverse, dy * inverse, bulge);
            add(pixel, m, cover, m.colour * (0.85f + roundness * (shaded - 0.85f)));
        });
    }

    // Draws a flat disc with the normal n. Above a pixel (x, y) from its centre it has the height z = -(n_x x + n_y y)
    // / n_z, and it covers the pixel while r = |(x, y, z)| <= R. The edge is as wide as a pixel: (R - r) / |grad r|
    // from it.
    template <bool hidden>
    void card(const Mark& m)
    {
        const float slope_x = -m.dx / m.ddepth, slope_y = -m.dy / m.ddepth;
        const Vec3f colour = m.additive ? m.colour : Vec3f(m.colour * shade(m.dx, m.dy, m.ddepth));
        for_each_pixel(m, [&](Pixel& pixel, std::size_t offset, float dx, float dy) {
            const float z = slope_x * dx + slope_y * dy, r = std::sqrt(dx * dx + dy * dy + z * z);
            const float grad = std::hypot(dx + z * slope_x, dy + z * slope_y) / std::max(r, 1e-6f);
            float cover = m.opacity * std::clamp((m.radius - r) / std::max(grad, 1.0f) + 0.5f, 0.0f, 1.0f);
            if (cover == 0) return;
            if constexpr (hidden) cover *= visible_fraction(offset, m.depth - z * m.metres / m.radius);
            add(pixel, m, cover, colour);
        });
    }

    // Draws a disc of radius R that moves uniformly along L. It covers a pixel at distance w from its line while
    // |u - s L| <= sqrt(R² - w²), s from 0 to 1. That root is averaged over the pixel's width, so that the brightness
    // of a line does not depend on its alignment with the pixels.
    template <bool hidden>
    void streak(const Mark& m)
    {
        const float ux = m.dx / m.length, uy = m.dy / m.length, R = m.radius, inverse = 1 / m.length;
        // Returns the integral of sqrt(R² - w²).
        const auto area = [&](float w) {
            const float t = std::clamp(w / R, -1.0f, 1.0f);
            return 0.5f * R * R * (t * std::sqrt(1 - t * t) + std::asin(t));
        };
        const float roundness = roundness_of(m);
        const Vec3f flat = m.additive ? m.colour : Vec3f(0.85f * m.colour);
        for_each_pixel(m, [&](Pixel& pixel, std::size_t offset, float dx, float dy) {
            const float side = ux * dy - uy * dx, w = std::abs(side), u = ux * dx + uy * dy;
            if (w >= R + 0.5f) return;
            const float half = area(w + 0.5f) - area(w - 0.5f);
            const float time = (std::min(u + half, m.length) - std::max(u - half, 0.0f)) * inverse;
            if (time <= 0) return;
            float cover = m.opacity * std::min(time, 1.0f);
            if constexpr (hidden)
                cover *= visible_fraction(offset, m.depth + std::clamp(u * inverse, 0.0f, 1.0f) * m.ddepth - m.metres);
            if (roundness == 0) return add(pixel, m, cover, flat);
            // Shades it like the nearest ball along the way.
            const float past = u - std::clamp(u, 0.0f, m.length);
            const float nx = (ux * past - uy * side) / R, ny = (uy * past + ux * side) / R;
            const float shaded = shade(nx, ny, std::sqrt(std::max(0.0f, 1 - nx * nx - ny * ny)));
            add(pixel, m, cover, m.colour * (0.85f + roundness * (shaded - 0.85f)));
        });
    }

    // Draws a segment of a trail. A pixel belongs to only one of two consecutive segments.
    template <bool hidden>
    void line(const Mark& m)
    {
        const float ux = m.dx / m.length, uy = m.dy / m.length, inverse = 1 / m.length;
        const Vec3f flat = m.additive ? m.colour : Vec3f(0.85f * m.colour);
        for_each_pixel(m, [&](Pixel& pixel, std::size_t offset, float dx, float dy) {
            const float w = std::abs(ux * dy - uy * dx), u = ux * dx + uy * dy;
            if (u < 0 || u >= m.length || w >= m.radius + 0.5f) return;
            float cover = m.opacity * std::min(m.radius + 0.5f - w, 1.0f);
            if constexpr (hidden) cover *= visible_fraction(offset, m.depth + u * inverse * m.ddepth - m.metres);
            add(pixel, m, cover, flat);
        });
    }

    // Returns the brightness of a ball with the normal (nx right, ny down, nz to the viewer) in the view.
    float shade(float nx, float ny, float nz) const
    {
        const Vec3f n = lens_.right * nx - lens_.up * ny - lens_.forward * nz;
        const float lamp = 0.5f + 0.5f * n.dot(light_.direction());
        return 0.25f + 0.95f * lamp * lamp;
    }

    const SurfaceTile& surfaces_;
    const Lens& lens_;
    const Light& light_;
    int x0_, y0_, x1_, y1_;  // bounds of the tile in the picture
    std::array<Pixel, tile_pixels> pixels_;
};

// Depths are positive, so their bits sort like their values.
std::uint64_t depth_key(float depth, std::size_t mark)
{
    return std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | mark;
}

}  // namespace

std::vector<float> shadow_opacity(const PointSet& points, const PictureScene& scene)
{
    const auto* Cd = points.find<Vec3f>("Cd");
    const auto* Alpha = points.find<float>("Alpha");
    if (!Cd && !Alpha && scene.styles.empty()) return {};
    const PointStyles styles(points, scene);
    std::vector<float> opacity(points.size());
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const float dark = Cd ? 1 - glow((*Cd)[i]) : 1;
            opacity[i] = styles.is_additive(i) || !(dark > 0) ? 0 : dark * opacity_of(Alpha, i);
        }
    });
    return opacity;
}

// Performs a counting sort in two passes over blocks of points. Each block has its own range in every tile.
Marks make_marks(const PointSet& points, const TileGrid& tiles, const PictureScene& scene, const PictureView& view,
                 const Light& light)
{
    const PointLook look(points, tiles, scene, view, light);
    Marks marks;
    const std::size_t size = points.size(), n = size * (1 + look.trails.places());
    const auto count = static_cast<std::size_t>(tiles.count());
    marks.all.resize(n);
    constexpr std::size_t block = 16 * chunk_size;
    const std::size_t blocks = (n + block - 1) / block;
    std::vector<std::vector<std::uint32_t>> next_in(blocks, std::vector<std::uint32_t>(count, 0));
    const auto for_each_block = [&](const auto& f) {
        tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
            for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i) f(i, next_in[b]);
        });
    };
    for_each_block([&](std::size_t i, std::vector<std::uint32_t>& counts) {
        marks.all[i] = i < size ? look.mark(i) : look.piece(i % size, static_cast<int>(i / size), look.mark(i % size));
        if (marks.all[i].radius > 0) for_each_tile_of(marks.all[i], tiles, [&](int t) { ++counts[t]; });
    });
    std::uint32_t total = 0;
    for (std::size_t t = 0; t < count; ++t) {
        marks.first.push_back(total);
        for (std::size_t b = 0; b < blocks; ++b) total += std::exchange(next_in[b][t], total);
    }
    marks.first.push_back(total);
    marks.of_tiles.resize(total);
    for_each_block([&](std::size_t i, std::vector<std::uint32_t>& next) {
        if (marks.all[i].radius > 0)
            for_each_tile_of(marks.all[i], tiles,
                             [&](int t) { marks.of_tiles[next[t]++] = depth_key(marks.all[i].depth, i); });
    });
    return marks;
}

void draw_marks(const Marks& marks, const TileGrid& tiles, int tile, const SurfaceTile& surfaces, const Lens& lens,
                const Light& light, std::span<Vec3f> colour)
{
    thread_local PerThread<std::vector<std::uint64_t>> kept;
    std::vector<std::uint64_t>& order = *kept;
    order.assign(marks.of_tiles.begin() + marks.first[tile], marks.of_tiles.begin() + marks.first[tile + 1]);
    std::sort(order.begin(), order.end());
    TilePainter painter(tiles, tile, surfaces, lens, light);
    constexpr std::size_t ahead = 8;  // marks to prefetch; in order of depth they are scattered in memory
    const auto mark = [&](std::size_t k) -> const Mark& { return marks.all[static_cast<std::uint32_t>(order[k])]; };
    for (std::size_t k = 0; k < order.size(); ++k) {
        if (k + ahead < order.size()) __builtin_prefetch(&mark(k + ahead));
        painter.composite(mark(k));
    }
    painter.finish(colour);
}

}  // namespace rapid

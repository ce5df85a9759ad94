#include "runtime/picture/surfaces.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/base/per_thread.h"
#include "runtime/picture/screen_mesh.h"
#include "runtime/picture/tone.h"

namespace rapid {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

// Linear colours, dark enough that points of any colour stand out, and light enough to show the obstacles.
const Vec3f sky(0.0180f, 0.0215f, 0.0290f);      // at the upper edge
const Vec3f horizon(0.0080f, 0.0090f, 0.0115f);  // at the lower edge
const Vec3f collider_albedo(0.105f, 0.112f, 0.125f);
const Vec3f emitter_glow(0.10f, 0.085f, 0.05f);

ShadedSample shade_collider(const Vec3f& P, const Vec3f& n, const Vec3f& to_eye, const Light& light)
{
    const float lamp = std::max(0.0f, n.dot(light.direction()));
    const float seen = lamp > 0 ? lamp * light.mesh_transmittance(P, n) : 0;
    const float from_sky = 0.6f + 0.4f * n.y();
    const float facing = std::clamp(n.dot(to_eye), 0.0f, 1.0f);
    const float rim = (1 - facing) * (1 - facing) * (1 - facing) * (1 - facing);
    const Vec3f of_lamp = collider_albedo * (1.2f * seen);
    return {collider_albedo * (light_from_sky * from_sky) + Vec3f(0.045f, 0.052f, 0.066f) * rim + of_lamp, of_lamp};
}

// Returns the background colour: a gradient, darker at the sides.
Vec3f backdrop(int x, int y, const PictureOptions& options)
{
    const float down = (static_cast<float>(y) + 0.5f) / static_cast<float>(options.height);
    const float aside = 2 * (static_cast<float>(x) + 0.5f) / static_cast<float>(options.width) - 1;
    return (sky + (horizon - sky) * down) * (1 - 0.3f * aside * aside);
}

// A body on the raster of samples, with the triangles that may be in each tile.
struct DrawnBody {
    const PictureScene::Body* body;
    ScreenMesh mesh;
    std::vector<std::uint32_t> first, triangles;  // start of each tile in `triangles`, plus the end; triangles in order

    DrawnBody(const PictureScene::Body& drawn, const Lens& lens, float near, const TileGrid& tiles)
        : body(&drawn), mesh(*drawn.mesh, lens, near), first(tiles.count() + 1, 0)
    {
        constexpr float size = tile_size * surface_samples;
        const auto for_each_tile = [&](const ScreenTriangle& triangle, const auto& f) {
            const auto tile = [](float at, int count) {
                return static_cast<int>(std::clamp(std::floor(at / size), 0.0f, static_cast<float>(count - 1)));
            };
            if (triangle.high_y < 0 || triangle.low_y > size * static_cast<float>(tiles.down)) return;
            if (triangle.high_x() < 0 || triangle.low_x() > size * static_cast<float>(tiles.across)) return;
            for (int j = tile(triangle.low_y, tiles.down); j <= tile(triangle.high_y, tiles.down); ++j)
                for (int i = tile(triangle.low_x(), tiles.across); i <= tile(triangle.high_x(), tiles.across); ++i)
                    f(static_cast<std::size_t>(j * tiles.across + i));
        };
        const std::vector<ScreenTriangle>& all = mesh.triangles();
        for (const ScreenTriangle& triangle : all) for_each_tile(triangle, [&](std::size_t t) { ++first[t]; });
        std::uint32_t total = 0;
        for (std::uint32_t& count : first) total += std::exchange(count, total);
        triangles.resize(total);
        std::vector<std::uint32_t> next = first;
        for (std::size_t i = 0; i < all.size(); ++i)
            for_each_tile(all[i], [&](std::size_t t) { triangles[next[t]++] = static_cast<std::uint32_t>(i); });
    }
};

constexpr int samples_per_pixel = surface_samples * surface_samples;

// The nearest surface at a sample.
struct Sample {
    Vec3f colour, lamp, P;
    float depth;
    const ScreenTriangle* triangle;  // null: the background
    Vec3f weights;                   // of the triangle's corners
};

class SurfacePainter {
public:
    SurfacePainter(const PictureOptions& options, const PictureScene& scene, const PictureView& view,
                   const Light& light)
        : options_(options),
          light_(light),
          tiles_{options.width, options.height},
          lens_(Lens::of_camera(view.camera, options.width * surface_samples, options.height * surface_samples)),
          near_scene_(view.bounds.cast<float>()),
          extent_(std::max(1e-6f, near_scene_.diagonal().norm()))
    {
        constexpr auto at = [](int half) { return 0.5f * static_cast<float>(half); };
        for (int k = 0; k <= 2 * surface_samples * options.width; ++k)
            columns_.push_back(lens_.forward + lens_.right * ((at(k) - lens_.center_x) / lens_.focal));
        for (int k = 0; k <= 2 * surface_samples * options.height; ++k)
            rows_.push_back(lens_.up * ((lens_.center_y - at(k)) / lens_.focal));
        const float near = 1e-3f * static_cast<float>((view.camera.target - view.camera.position).norm());
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            auto& drawn = scene.bodies[b].role == PictureScene::Body::Collider ? colliders_ : emitters_;
            drawn.emplace_back(scene.bodies[b], lens_, near, tiles_);
        }
        for (const PictureScene::Plane& plane : scene.planes) {
            const Ground ground(plane, view, true);
            if (!ground.hides_scene(lens_.origin)) grounds_.push_back(ground);
        }
        if (scene.planes.empty() && options.grid && scene.grid)
            grounds_.emplace_back(PictureScene::Plane(), view, false);
    }

    SurfaceTile draw(int tile) const { return has_body(tile) ? draw_bodies(tile) : draw_open(tile); }

    const TileGrid& tiles() const { return tiles_; }

private:
    using Pixel = std::array<Sample*, samples_per_pixel>;

    bool has_body(int tile) const
    {
        const auto has = [&](const DrawnBody& body) { return body.first[tile] != body.first[tile + 1]; };
        return std::any_of(colliders_.begin(), colliders_.end(), has) ||
               std::any_of(emitters_.begin(), emitters_.end(), has);
    }

    // Draws a tile that only has backdrop and grounds, with just the samples of one pixel at a time.
    SurfaceTile draw_open(int tile) const
    {
        SurfaceTile result = empty_tile();
        std::array<Sample, samples_per_pixel> samples;
        Pixel pixel;
        for (int k = 0; k < samples_per_pixel; ++k) pixel[k] = &samples[k];
        for (int y = tiles_.top(tile); y < tiles_.bottom(tile); ++y)
            for (int x = tiles_.left(tile); x < tiles_.right(tile); ++x) {
                draw_background(x, y, pixel);
                add_pixel(result, tile, x, y, pixel);
            }
        return finished(tile, std::move(result));
    }

    SurfaceTile draw_bodies(int tile) const
    {
        constexpr int across = tile_size * surface_samples;
        thread_local PerThread<std::vector<Sample>> kept;
        std::vector<Sample>& samples = *kept;
        samples.resize(across * across);
        const RasterPart part{tiles_.left(tile) * surface_samples, tiles_.top(tile) * surface_samples,
                              tiles_.right(tile) * surface_samples, tiles_.bottom(tile) * surface_samples};
        const auto sample = [&](int x, int y) -> Sample& {
            return samples[static_cast<std::size_t>((y - part.y0) * across + x - part.x0)];
        };
        const auto for_each_pixel = [&](const auto& f) {
            for (int y = tiles_.top(tile); y < tiles_.bottom(tile); ++y)
                for (int x = tiles_.left(tile); x < tiles_.right(tile); ++x) {
                    Pixel pixel;
                    for (int k = 0; k < samples_per_pixel; ++k)
                        pixel[k] = &sample(x * surface_samples + k % surface_samples,
                                           y * surface_samples + k / surface_samples);
                    f(x, y, pixel);
                }
        };
        for_each_pixel([&](int x, int y, const Pixel& pixel) { draw_background(x, y, pixel); });
        for (const DrawnBody& body : colliders_) draw_collider(body, tile, part, sample);
        for (int y = part.y0; y < part.y1; ++y)
            for (int x = part.x0; x < part.x1; ++x)
                if (sample(x, y).triangle) shade(sample(x, y), x, y);
        for (const DrawnBody& body : emitters_) draw_emitter(body, tile, part, sample);
        SurfaceTile result = empty_tile();
        for_each_pixel([&](int x, int y, const Pixel& pixel) { add_pixel(result, tile, x, y, pixel); });
        return finished(tile, std::move(result));
    }

    // Returns the ray through a position on the raster of samples, in half samples. Not normalised: its depth is a
    // metre.
    Vec3f ray(int half_x, int half_y) const { return columns_[half_x] + rows_[half_y]; }

    // Draws backdrop and grounds, shaded once per pixel because lines on the ground are antialiased analytically. Each
    // sample has its own depth.
    void draw_background(int x, int y, const Pixel& pixel) const
    {
        const Vec3f middle = ray((2 * x + 1) * surface_samples, (2 * y + 1) * surface_samples);
        const Vec3f open = backdrop(x, y, options_);
        const Ground* nearest = nullptr;
        float t = infinite;
        for (const Ground& ground : grounds_)
            if (const float depth = ground.depth(lens_.origin, middle); depth < t) t = depth, nearest = &ground;
        ShadedSample shaded{open, Vec3f::Zero()};
        Vec3f P = Vec3f::Zero();
        if (nearest) {
            P = lens_.origin + middle * t;
            shaded = nearest->shade(P, t, lens_.focal / surface_samples, middle, open, light_);
        }
        for (int k = 0; k < samples_per_pixel; ++k) {
            const int sx = x * surface_samples + k % surface_samples, sy = y * surface_samples + k / surface_samples;
            const bool solid = nearest && nearest->solid;
            const float depth = solid ? nearest->depth(lens_.origin, ray(2 * sx + 1, 2 * sy + 1)) : infinite;
            *pixel[k] = {shaded.colour, shaded.lamp, P, depth, nullptr, Vec3f::Zero()};
        }
    }

    // Calls f(sample, weights, depth, triangle) for the samples of a body that no surface drawn earlier hides.
    template <class Samples, class F>
    static void for_each_sample(const DrawnBody& body, int tile, const RasterPart& part, const Samples& sample,
                                const F& f)
    {
        for (std::uint32_t i = body.first[tile]; i < body.first[tile + 1]; ++i) {
            const ScreenTriangle& triangle = body.mesh.triangles()[body.triangles[i]];
            body.mesh.cover(triangle, part, [&](int x, int y, const Vec3f& weights, float depth) {
                Sample& here = sample(x, y);
                if (depth < here.depth) f(here, weights, depth, triangle);
            });
        }
    }

    static Vec3f face_of(const ScreenTriangle& triangle)
    {
        const ScreenCorner* c = triangle.corners;
        return (c[1].P - c[0].P).cross(c[2].P - c[0].P);
    }

    // Finds the nearest triangle. Skips the sides of a vessel that face the viewer.
    template <class Samples>
    void draw_collider(const DrawnBody& body, int tile, const RasterPart& part, const Samples& sample) const
    {
        for_each_sample(body, tile, part, sample,
                        [&](Sample& here, const Vec3f& weights, float depth, const ScreenTriangle& triangle) {
                            if (body.body->is_vessel && face_of(triangle).dot(lens_.origin - triangle.corners[0].P) > 0)
                                return;
                            here.depth = depth;
                            here.triangle = &triangle;
                            here.weights = weights;
                        });
    }

    void shade(Sample& here, int x, int y) const
    {
        const ScreenCorner* c = here.triangle->corners;
        const Vec3f& w = here.weights;
        here.P = w[0] * c[0].P + w[1] * c[1].P + w[2] * c[2].P;
        const Vec3f smooth = (w[0] * c[0].n + w[1] * c[1].n + w[2] * c[2].n).normalized();
        const Vec3f to_eye = (lens_.origin - here.P).normalized();
        const Vec3f n = face_of(*here.triangle).dot(to_eye) > 0 ? smooth : Vec3f(-smooth);
        const ShadedSample shaded = shade_collider(here.P, n, to_eye, light_);
        // Far from the scene, such as in the distant part of a floor, it dissolves into the backdrop.
        const float away = near_scene_.exteriorDistance(here.P) / extent_, fade = std::exp(-away * away);
        const Vec3f open = backdrop(x / surface_samples, y / surface_samples, options_);
        here.colour = open + (shaded.colour - open) * fade;
        here.lamp = shaded.lamp * fade;
    }

    // Draws the outline of an emitter as a glow over the background. It shows where points come from without hiding
    // them.
    template <class Samples>
    void draw_emitter(const DrawnBody& body, int tile, const RasterPart& part, const Samples& sample) const
    {
        for_each_sample(body, tile, part, sample,
                        [&](Sample& here, const Vec3f& w, float, const ScreenTriangle& triangle) {
                            const ScreenCorner* c = triangle.corners;
                            const Vec3f P = w[0] * c[0].P + w[1] * c[1].P + w[2] * c[2].P;
                            const Vec3f n = (w[0] * c[0].n + w[1] * c[1].n + w[2] * c[2].n).normalized();
                            const float facing = std::abs(n.dot((lens_.origin - P).normalized()));
                            here.colour += emitter_glow * (0.06f + 0.5f * (1 - facing) * (1 - facing));
                        });
    }

    static SurfaceTile empty_tile()
    {
        SurfaceTile tile;
        tile.colour.resize(tile_pixels, Vec3f::Zero());
        tile.bytes.resize(3 * tile_pixels);
        tile.depth.resize(tile_pixels * samples_per_pixel, infinite);
        tile.nearest = infinite;
        tile.farthest = 0;
        return tile;
    }

    SurfaceTile finished(int tile, SurfaceTile result) const
    {
        const int left = tiles_.left(tile), top = tiles_.top(tile);
        const auto across = static_cast<std::size_t>(tiles_.right(tile) - left);
        for (int y = top; y < tiles_.bottom(tile); ++y) {
            const auto row = static_cast<std::size_t>((y - top) * tile_size);
            write_pixels({&result.colour[row], across}, left, y, &result.bytes[3 * row]);
        }
        if (result.nearest == infinite) result.depth = std::vector<float>();  // {} would keep its memory
        result.lit.shrink_to_fit();
        return result;
    }

    // Combines samples into a pixel.
    void add_pixel(SurfaceTile& result, int tile, int x, int y, const Pixel& samples) const
    {
        const auto pixel = static_cast<std::size_t>((y - tiles_.top(tile)) * tile_size + x - tiles_.left(tile));
        for (int k = 0; k < samples_per_pixel; ++k) {
            result.colour[pixel] += samples[k]->colour / samples_per_pixel;
            result.depth[pixel * samples_per_pixel + k] = samples[k]->depth;
            result.nearest = std::min(result.nearest, samples[k]->depth);
            result.farthest = std::max(result.farthest, samples[k]->depth);
        }
        add_lit(result, static_cast<std::uint32_t>(pixel), samples);
    }

    // Samples whose positions in the shadow grid are close share an entry.
    void add_lit(SurfaceTile& tile, std::uint32_t pixel, const Pixel& samples) const
    {
        const std::size_t first = tile.lit.size();
        const Sample* before = nullptr;
        std::size_t entry = 0;  // entry of `before`
        for (const Sample* sample : samples) {
            if (sample->lamp.isZero(0)) continue;
            const Vec3f lamp = sample->lamp / samples_per_pixel;
            if (!before || sample->P != before->P) entry = entry_of(tile, first, pixel, light_.cell_of(sample->P));
            tile.lit[entry].lamp += lamp;
            before = sample;
        }
    }

    static std::size_t entry_of(SurfaceTile& tile, std::size_t first, std::uint32_t pixel, const Vec3f& cell)
    {
        const auto same = std::find_if(
            tile.lit.begin() + static_cast<std::ptrdiff_t>(first), tile.lit.end(),
            [&](const SurfaceTile::Lit& other) { return (other.cell - cell).squaredNorm() < 0.25f * 0.25f; });
        if (same != tile.lit.end()) return static_cast<std::size_t>(same - tile.lit.begin());
        tile.lit.push_back({pixel, Vec3f::Zero(), cell});
        tile.cells.extend(cell);
        return tile.lit.size() - 1;
    }

    const PictureOptions& options_;
    const Light& light_;
    TileGrid tiles_;
    Lens lens_;
    std::vector<Vec3f> columns_, rows_;  // at each half sample; a ray is the sum of its column and its row
    std::vector<DrawnBody> colliders_, emitters_;
    std::vector<Ground> grounds_;
    Box3f near_scene_;
    float extent_;  // m, size of the scene
};

}  // namespace

std::vector<SurfaceTile> draw_surfaces(const PictureOptions& options, const PictureScene& scene,
                                       const PictureView& view, const Light& light)
{
    const SurfacePainter painter(options, scene, view, light);
    std::vector<SurfaceTile> tiles(painter.tiles().count());
    tbb::parallel_for(0, painter.tiles().count(), [&](int tile) { tiles[tile] = painter.draw(tile); });
    return tiles;
}

namespace {

const Vec3f ground_albedo(0.0285f, 0.0305f, 0.0345f);
const Vec3f grid_colour(0.070f, 0.076f, 0.088f);

}  // namespace

Ground::Ground(const PictureScene::Plane& plane, const PictureView& view, bool is_solid)
    : normal(plane.normal.normalized().cast<float>()),
      offset(static_cast<float>(plane.offset / plane.normal.norm())),
      spacing(static_cast<float>(view.line_spacing)),
      scene_center(view.bounds.center().cast<float>()),
      center(view.ground.value_or(view.bounds).center().cast<float>()),
      extent(static_cast<float>(1.2 * std::max(1e-6, view.ground.value_or(view.bounds).diagonal().norm()))),
      solid(is_solid)
{
    u = std::abs(normal.y()) > 0.99f ? Vec3f::UnitX().eval() : any_tangent(normal);
    v = u.cross(normal);
}

// Returns the fraction of a pixel that a line covers. x: m from the origin; pixel: its width on the ground, m.
float Ground::line(float x, float pixel) const
{
    const float away = std::abs(x - spacing * std::round(x / spacing));
    const float width = std::max(0.004f * spacing, 0.5f * pixel);
    const float seen = std::clamp((width + 0.5f * pixel - away) / pixel, 0.0f, 1.0f);
    // Lines closer than a few pixels would shimmer, so they fade out.
    return seen * std::clamp(1.5f - 4 * pixel / spacing, 0.0f, 1.0f);
}

ShadedSample Ground::shade(const Vec3f& P, float t, float focal, const Vec3f& ray, const Vec3f& background,
                           const Light& light) const
{
    const float slope = std::max(0.02f, std::abs(normal.dot(ray.normalized())));
    const float pixel = t / focal;
    const Vec3f along = P - normal * offset;
    // At a flat angle a pixel is longer on the ground, so lines across the view direction are drawn wider.
    const Vec3f view_on_ground = (ray - normal * normal.dot(ray)).normalized();
    const auto width = [&](const Vec3f& axis) {
        const float across = std::abs(view_on_ground.dot(axis));
        return pixel * (1 + across * (1 / slope - 1));
    };
    const float lines = std::max(line(along.dot(u), width(u)), line(along.dot(v), width(v)));
    const float fade = std::exp(-(P - center).squaredNorm() / (extent * extent));
    if (!solid) return {background + (grid_colour - background) * (0.55f * lines * fade), Vec3f::Zero()};

    const float seen = std::abs(light.direction().dot(normal)) * light.mesh_transmittance(P, normal);
    const Vec3f lamp = ground_albedo * ((1 - light_from_sky) * seen * (1 - 0.45f * lines));
    const Vec3f ground = ground_albedo * (light_from_sky * (1 - 0.45f * lines)) + grid_colour * (0.45f * lines) + lamp;
    return {background + (ground - background) * fade, lamp * fade};
}

}  // namespace rapid

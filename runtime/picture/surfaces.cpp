#include "runtime/picture/surfaces.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "runtime/parallel.h"

namespace rapid {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

// Linear colours. Dark enough that points of any colour stand out, light enough to see what they bounce off.
const Vec3f sky(0.0180f, 0.0215f, 0.0290f);      // at the upper edge
const Vec3f horizon(0.0080f, 0.0090f, 0.0115f);  // at the lower edge
const Vec3f collider_albedo(0.105f, 0.112f, 0.125f);
const Vec3f ground_albedo(0.0285f, 0.0305f, 0.0345f);
const Vec3f grid_colour(0.070f, 0.076f, 0.088f);
const Vec3f emitter_glow(0.10f, 0.085f, 0.05f);

constexpr int shadow_size = 1024;        // texels of the meshes' shadows
constexpr int cells = 160;               // of the points' shadows, across
constexpr int slices = 64;               // and along the light
constexpr float light_from_sky = 0.30f;  // of the light that reaches an open place; the rest is the lamp's

// Splits [0, n) into bands that the threads share.
template <class F>
void for_each_band(int n, const F& f)
{
    constexpr int band = 16;
    tbb::parallel_for(0, (n + band - 1) / band, [&](int i) { f(i * band, std::min(n, (i + 1) * band)); });
}

struct Corner {
    Vec3f P, n;
    Vec3f screen = Vec3f::Zero();  // x, y and 1 / depth (of parallel rays: depth)
};

struct Triangle {
    Corner corners[3];
    float low_y, high_y;
};

// The triangles of a mesh on the raster, cut where they come too near. A corner's normal is its vertex's unless the
// face turns away from that by more than 40°: edges stay sharp, round shapes round.
class ScreenMesh {
public:
    ScreenMesh(const Mesh& mesh, const Lens& lens, float near) : lens_(lens), near_(near)
    {
        std::vector<Vec3f> normals(mesh.positions.size(), Vec3f::Zero());
        std::vector<Vec3f> faces(mesh.triangles.size());
        for (std::size_t t = 0; t < faces.size(); ++t) {
            const auto& triangle = mesh.triangles[t];
            const Vec3f& a = mesh.positions[triangle[0]];
            faces[t] = (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a);
            for (int c = 0; c < 3; ++c) normals[triangle[c]] += faces[t];
            faces[t].normalize();
        }
        for (Vec3f& normal : normals) normal.normalize();

        constexpr float cos_40 = 0.766f;
        triangles_.reserve(faces.size());
        for (std::size_t t = 0; t < faces.size(); ++t) {
            Corner corners[3];
            for (int c = 0; c < 3; ++c) {
                const std::int32_t vertex = mesh.triangles[t][c];
                const bool round = faces[t].dot(normals[vertex]) > cos_40;
                corners[c] = {mesh.positions[vertex], round ? normals[vertex] : faces[t]};
            }
            add_clipped(corners);
        }
    }

    // Calls f(x, y, weights of the corners, depth, triangle) for every sample whose centre a triangle covers, in the
    // order of the triangles; rows [begin, end).
    template <class F>
    void cover(int width, int begin, int end, const F& f) const
    {
        for (const Triangle& triangle : triangles_) {
            if (triangle.high_y < static_cast<float>(begin) || triangle.low_y > static_cast<float>(end)) continue;
            cover(triangle, width, begin, end, f);
        }
    }

private:
    void add(const Corner& a, const Corner& b, const Corner& c)
    {
        Triangle triangle{{a, b, c}, infinite, -infinite};
        for (Corner& corner : triangle.corners) {
            const Vec3f s = lens_.project(corner.P);
            corner.screen = {s.x(), s.y(), lens_.parallel ? s.z() : 1 / s.z()};
            triangle.low_y = std::min(triangle.low_y, s.y());
            triangle.high_y = std::max(triangle.high_y, s.y());
        }
        if (std::isfinite(triangle.low_y) && std::isfinite(triangle.high_y)) triangles_.push_back(triangle);
    }

    void add_clipped(const Corner (&corners)[3])
    {
        std::vector<Corner> kept;
        for (int c = 0; c < 3; ++c) {
            const Corner &a = corners[c], &b = corners[(c + 1) % 3];
            const float da = (a.P - lens_.origin).dot(lens_.forward) - near_;
            const float db = (b.P - lens_.origin).dot(lens_.forward) - near_;
            if (lens_.parallel || da > 0) kept.push_back(a);
            if (!lens_.parallel && (da > 0) != (db > 0)) {
                const float t = da / (da - db);
                kept.push_back({a.P + t * (b.P - a.P), (a.n + t * (b.n - a.n)).normalized()});
            }
        }
        for (std::size_t k = 2; k < kept.size(); ++k) add(kept[0], kept[k - 1], kept[k]);
    }

    template <class F>
    void cover(const Triangle& triangle, int width, int begin, int end, const F& f) const
    {
        const Vec3f &a = triangle.corners[0].screen, &b = triangle.corners[1].screen, &c = triangle.corners[2].screen;
        const auto edge = [](const Vec3f& p, const Vec3f& q, float x, float y) {
            return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
        };
        const float area = edge(a, b, c.x(), c.y());
        if (area == 0) return;
        const auto clamp_to = [](float value, int low, int high) {
            return static_cast<int>(std::clamp(value, static_cast<float>(low), static_cast<float>(high)));
        };
        const int y0 = clamp_to(std::floor(triangle.low_y), begin, end);
        const int y1 = clamp_to(std::ceil(triangle.high_y), begin, end);
        const int x0 = clamp_to(std::floor(std::min({a.x(), b.x(), c.x()})), 0, width);
        const int x1 = clamp_to(std::ceil(std::max({a.x(), b.x(), c.x()})), 0, width);
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
                const float at_x = static_cast<float>(x) + 0.5f, at_y = static_cast<float>(y) + 0.5f;
                Vec3f weights(edge(b, c, at_x, at_y), edge(c, a, at_x, at_y), edge(a, b, at_x, at_y));
                weights /= area;
                if (weights.minCoeff() < 0) continue;
                const float z = weights.dot(Vec3f(a.z(), b.z(), c.z()));
                // Weights on the screen become weights on the triangle.
                if (!lens_.parallel) weights = weights.cwiseProduct(Vec3f(a.z(), b.z(), c.z())) / z;
                f(x, y, weights, lens_.parallel ? z : 1 / z, triangle);
            }
    }

    const Lens& lens_;
    float near_;
    std::vector<Triangle> triangles_;
};

Vec3f any_tangent(const Vec3f& n)
{
    const Vec3f axis = std::abs(n.y()) < 0.9f ? Vec3f::UnitY().eval() : Vec3f::UnitX().eval();
    return axis.cross(n).normalized();
}

Vec3f light_direction(const Camera& camera)
{
    const Lens lens = Lens::of_camera(camera, 2, 2);
    // From above, a little from the left, and from behind the viewer: shapes are lit where one looks at them, and
    // shadows fall to the right.
    const Vec3f across = lens.right * -0.45f + Vec3f::UnitY() * 0.85f - lens.forward * 0.35f;
    return across.normalized();
}

}  // namespace

Lens Lens::of_camera(const Camera& camera, int width, int height)
{
    Lens lens;
    lens.origin = camera.position.cast<float>();
    Vec3d forward = camera.target - camera.position;
    forward = forward.norm() > 0 ? forward.normalized().eval() : Vec3d(0, 0, -1);
    Vec3d right = forward.cross(Vec3d::UnitY());
    right = right.norm() > 1e-6 ? right.normalized().eval() : Vec3d::UnitX().eval();
    lens.forward = forward.cast<float>();
    lens.right = right.cast<float>();
    lens.up = right.cross(forward).cast<float>();
    lens.focal = static_cast<float>(0.5 * height / std::tan(0.5 * camera.fov));
    lens.center_x = 0.5f * static_cast<float>(width);
    lens.center_y = 0.5f * static_cast<float>(height);
    return lens;
}

Light::Light(const PointSet& points, const PictureOptions& options, const PictureScene& scene, const PictureView& view)
    : direction_(light_direction(view.camera))
{
    const float radius = std::max(1e-6f, 0.7f * static_cast<float>(view.bounds.diagonal().norm()));
    depth_range_ = 2 * radius;
    lens_.forward = -direction_;
    lens_.right = any_tangent(direction_);
    lens_.up = lens_.right.cross(lens_.forward);
    lens_.origin = view.bounds.center().cast<float>() + direction_ * radius;
    lens_.focal = 0.5f * shadow_size / radius;
    lens_.center_x = lens_.center_y = 0.5f * shadow_size;
    lens_.parallel = true;

    const Lens eye = Lens::of_camera(view.camera, options.width, options.height);
    const double distance = (view.camera.target - view.camera.position).norm();
    draw_meshes(scene);
    gather_points(points, static_cast<float>(view.least_radius * distance) / eye.focal);
}

void Light::draw_meshes(const PictureScene& scene)
{
    mesh_depth_.assign(std::size_t{shadow_size} * shadow_size, infinite);
    for (const PictureScene::Body& body : scene.bodies) {
        if (body.role != PictureScene::Body::Collider) continue;
        const ScreenMesh mesh(*body.mesh, lens_, 0);
        for_each_band(shadow_size, [&](int begin, int end) {
            mesh.cover(shadow_size, begin, end, [&](int x, int y, const Vec3f&, float depth, const Triangle&) {
                float& nearest = mesh_depth_[static_cast<std::size_t>(y) * shadow_size + x];
                nearest = std::min(nearest, depth);
            });
        });
    }
}

void Light::gather_points(const PointSet& points, float least_radius)
{
    // Whole numbers, so that a sum does not depend on the order in which threads add.
    constexpr float unit = 4096;
    constexpr std::size_t slice = std::size_t{cells} * cells;
    constexpr float cells_a_texel = static_cast<float>(cells) / shadow_size;
    std::vector<std::atomic<std::uint64_t>> sums(slice * slices);
    const Strided<Vec3f> P = points.P().read();
    const Column<float>* pscale = points.find<float>("pscale");
    const float cells_a_metre = lens_.focal * cells_a_texel;
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3f s = lens_.project(P[i]);
            const float x = s.x() * cells_a_texel, y = s.y() * cells_a_texel, z = s.z() / depth_range_ * slices;
            if (!(x >= 0 && y >= 0 && z >= 0 && x < cells && y < cells && z < slices)) continue;
            const float r = std::max(least_radius, pscale ? (*pscale)[i] : 0.0f) * cells_a_metre;
            const float share = std::min(3.14159f * r * r, 16.0f);
            const std::size_t cell =
                static_cast<std::size_t>(z) * slice + static_cast<std::size_t>(y) * cells + static_cast<std::size_t>(x);
            sums[cell].fetch_add(static_cast<std::uint64_t>(unit * share + 0.5f), std::memory_order_relaxed);
        }
    });
    covered_.resize(sums.size());
    for (std::size_t i = 0; i < covered_.size(); ++i) covered_[i] = static_cast<float>(sums[i].load()) / unit;

    // Spread over the neighbours, twice across: no cell shows.
    std::vector<float> spread(covered_.size());
    for (int pass = 0; pass < 4; ++pass) {
        const bool along_x = pass % 2 == 0;
        const std::size_t step = along_x ? 1 : cells;
        tbb::parallel_for(0, slices, [&](int k) {
            for (int y = 0; y < cells; ++y)
                for (int x = 0; x < cells; ++x) {
                    const std::size_t here =
                        static_cast<std::size_t>(k) * slice + static_cast<std::size_t>(y) * cells + x;
                    const int at = along_x ? x : y;
                    const float before = at > 0 ? covered_[here - step] : 0;
                    const float after = at + 1 < cells ? covered_[here + step] : 0;
                    spread[here] = 0.25f * before + 0.5f * covered_[here] + 0.25f * after;
                }
        });
        std::swap(covered_, spread);
    }
    for (std::size_t i = slice; i < covered_.size(); ++i) covered_[i] += covered_[i - slice];
}

float Light::past_meshes(const Vec3f& P, const Vec3f& n) const
{
    // A surface is asked a little in front of itself, or the raster of the shadow would show on it.
    const float texel = 1 / lens_.focal;
    const Vec3f s = lens_.project(P + n * (2 * texel));
    if (!(s.x() >= 2 && s.y() >= 2 && s.x() < shadow_size - 2 && s.y() < shadow_size - 2)) return 1;
    // Nine texels, weighted by how much of each a square of two texels around s covers: the shadow's edge is a ramp.
    const int x = static_cast<int>(s.x()), y = static_cast<int>(s.y());
    const float fx = s.x() - static_cast<float>(x), fy = s.y() - static_cast<float>(y);
    const float wx[3] = {1 - fx, 1, fx}, wy[3] = {1 - fy, 1, fy};
    float open = 0;
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
            if (mesh_depth_[static_cast<std::size_t>(y + j - 1) * shadow_size + (x + i - 1)] > s.z() - 1.5f * texel)
                open += wx[i] * wy[j];
    return open / 4;
}

float Light::past_points(const Vec3f& P) const
{
    const Vec3f s = lens_.project(P);
    constexpr float cells_a_texel = static_cast<float>(cells) / shadow_size;
    const Vec3f at(s.x() * cells_a_texel - 0.5f, s.y() * cells_a_texel - 0.5f,
                   std::min(s.z() / depth_range_ * slices - 1, static_cast<float>(slices) - 1.001f));
    if (!(at.x() >= 0 && at.y() >= 0 && at.z() >= 0 && at.x() < cells - 1 && at.y() < cells - 1)) return 1;
    const Eigen::Vector3i cell = at.cast<int>();
    const Vec3f part = at - cell.cast<float>();
    float covered = 0;
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i) {
                const float weight =
                    (i ? part.x() : 1 - part.x()) * (j ? part.y() : 1 - part.y()) * (k ? part.z() : 1 - part.z());
                covered += weight * covered_[(static_cast<std::size_t>(cell.z() + k) * cells + cell.y() + j) * cells +
                                             static_cast<std::size_t>(cell.x() + i)];
            }
    return std::exp(-0.7f * covered);
}

namespace {

// Lines of a ground plane, a round number of metres apart, that fade out far from the scene.
struct Ground {
    Vec3f normal, u, v;
    float offset;
    float spacing;  // m
    Vec3f center;
    float extent;  // m, where lines have faded to 1/e
    bool solid;

    Ground(const PictureScene::Plane& plane, const Box3d& bounds, bool is_solid)
        : normal(plane.normal.normalized().cast<float>()),
          offset(static_cast<float>(plane.offset / plane.normal.norm())),
          solid(is_solid)
    {
        u = std::abs(normal.y()) > 0.99f ? Vec3f::UnitX().eval() : any_tangent(normal);
        v = u.cross(normal);
        const double size = std::max(1e-6, bounds.diagonal().norm());
        const double decade = std::pow(10.0, std::floor(std::log10(size / 8)));
        const double rest = size / 8 / decade;
        spacing = static_cast<float>(decade * (rest < 2 ? 1 : rest < 5 ? 2 : 5));
        center = bounds.center().cast<float>();
        extent = static_cast<float>(1.2 * size);
    }

    // How much of a line is in a pixel of that width, in metres on the ground, at distance x from the origin.
    float line(float x, float pixel) const
    {
        const float away = std::abs(x - spacing * std::round(x / spacing));
        const float width = std::max(0.004f * spacing, 0.5f * pixel);
        const float seen = std::clamp((width + 0.5f * pixel - away) / pixel, 0.0f, 1.0f);
        // Lines closer than a few pixels would shimmer.
        return seen * std::clamp(1.5f - 4 * pixel / spacing, 0.0f, 1.0f);
    }

    // Where the ray meets the plane; infinite where it does not.
    float depth(const Vec3f& origin, const Vec3f& ray) const
    {
        const float towards = normal.dot(ray);
        const float t = (offset - normal.dot(origin)) / towards;
        return towards != 0 && t > 0 && std::isfinite(t) ? t : infinite;
    }

    // Whether it is a wall that the eye is behind and the scene is not: then it is looked through.
    bool stands_before(const Vec3f& eye) const { return normal.dot(eye) < offset && normal.dot(center) >= offset; }

    Vec3f shade(const Vec3f& P, float t, float focal, const Vec3f& ray, const Vec3f& behind, const Light& light) const
    {
        const float slope = std::max(0.02f, std::abs(normal.dot(ray.normalized())));
        const float pixel = t / focal;
        const Vec3f along = P - normal * offset;
        // A pixel is longer on the ground where it is seen at a flat angle; lines across it are then wider.
        const Vec3f view_on_ground = (ray - normal * normal.dot(ray)).normalized();
        const auto width = [&](const Vec3f& axis) {
            const float across = std::abs(view_on_ground.dot(axis));
            return pixel * (1 + across * (1 / slope - 1));
        };
        const float lines = std::max(line(along.dot(u), width(u)), line(along.dot(v), width(v)));
        const float fade = std::exp(-(P - center).squaredNorm() / (extent * extent));
        if (!solid) return behind + (grid_colour - behind) * (0.55f * lines * fade);

        const float lamp =
            std::abs(light.direction().dot(normal)) * light.past_meshes(P, normal) * light.past_points(P);
        const Vec3f lit = ground_albedo * (light_from_sky + (1 - light_from_sky) * lamp);
        const Vec3f ground = lit + (grid_colour - lit) * (0.45f * lines);
        return behind + (ground - behind) * fade;
    }
};

Vec3f shade_collider(const Vec3f& P, const Vec3f& n, const Vec3f& to_eye, const Light& light)
{
    const float lamp = std::max(0.0f, n.dot(light.direction()));
    const float seen = lamp > 0 ? lamp * light.past_meshes(P, n) * light.past_points(P) : 0;
    const float from_sky = 0.6f + 0.4f * n.y();
    const float facing = std::clamp(n.dot(to_eye), 0.0f, 1.0f);
    const float rim = std::pow(1 - facing, 4.0f);
    return collider_albedo * (light_from_sky * from_sky + 1.2f * seen) + Vec3f(0.045f, 0.052f, 0.066f) * rim;
}

// What is behind everything: a gradient, darker to the sides.
Vec3f backdrop(int x, int y, const PictureOptions& options)
{
    const float down = (static_cast<float>(y) + 0.5f) / static_cast<float>(options.height);
    const float aside = 2 * (static_cast<float>(x) + 0.5f) / static_cast<float>(options.width) - 1;
    return (sky + (horizon - sky) * down) * (1 - 0.3f * aside * aside);
}

// Whether most points are inside the mesh: then it is a vessel, and what lies between them and the viewer is left out.
// A point is inside when a ray from it crosses the mesh an odd number of times.
bool holds_points(const Mesh& mesh, const PointSet& points)
{
    constexpr std::size_t sample_size = 63;
    const std::size_t step = std::max<std::size_t>(1, points.size() / sample_size);
    const Box3f bounds = mesh.bounds();
    std::size_t sampled = 0, inside = 0;
    for (std::size_t i = 0; i < points.size(); i += step, ++sampled) {
        const Vec3d P = points.P()[i].cast<double>();
        if (!bounds.contains(points.P()[i])) continue;
        bool odd = false;
        for (const Mesh::Triangle& triangle : mesh.triangles) {
            // Along y, by the projection to x and z; each edge belongs to one of the triangles on its sides.
            double height = 0, doubled = 0;
            bool hit = false;
            const Vec3f* corner[3];
            for (int c = 0; c < 3; ++c) corner[c] = &mesh.positions[triangle[c]];
            for (int c = 0; c < 3; ++c) {
                const Vec3f &a = *corner[c], &b = *corner[(c + 1) % 3];
                if ((a.z() > P.z()) != (b.z() > P.z())) {
                    const double t = (P.z() - a.z()) / (static_cast<double>(b.z()) - a.z());
                    if (P.x() < a.x() + t * (static_cast<double>(b.x()) - a.x())) hit = !hit;
                }
                const Vec3f& o = *corner[(c + 2) % 3];
                const double weight = (b.x() - a.x()) * (P.z() - a.z()) - (b.z() - a.z()) * (P.x() - a.x());
                height += weight * o.y();
                doubled += weight;
            }
            if (hit && height / doubled > P.y()) odd = !odd;
        }
        inside += odd;
    }
    return sampled > 0 && 2 * inside > sampled;
}

}  // namespace

Surfaces draw_surfaces(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
                       const PictureView& view, const Light& light)
{
    Surfaces result{options.width * surface_samples, options.height * surface_samples, {}, {}};
    const int width = result.width, height = result.height;
    result.colour.resize(static_cast<std::size_t>(width) * height);
    result.depth.assign(result.colour.size(), infinite);
    const Lens lens = Lens::of_camera(view.camera, width, height);

    std::vector<Ground> grounds;
    for (const PictureScene::Plane& plane : scene.planes) {
        const Ground ground(plane, view.bounds, true);
        if (!ground.stands_before(lens.origin)) grounds.push_back(ground);
    }
    if (scene.planes.empty() && options.grid) grounds.emplace_back(PictureScene::Plane(), view.bounds, false);

    // Once a pixel: lines on the ground are smooth as they are computed. Depths are a sample's own.
    for_each_band(options.height, [&](int begin, int end) {
        for (int y = begin; y < end; ++y)
            for (int x = 0; x < options.width; ++x) {
                constexpr float to_sample = surface_samples;
                const Vec3f ray =
                    lens.ray((static_cast<float>(x) + 0.5f) * to_sample, (static_cast<float>(y) + 0.5f) * to_sample);
                const Vec3f open = backdrop(x, y, options);
                const Ground* nearest = nullptr;
                float t = infinite;
                for (const Ground& ground : grounds)
                    if (const float depth = ground.depth(lens.origin, ray); depth < t) t = depth, nearest = &ground;
                const Vec3f colour =
                    nearest ? nearest->shade(lens.origin + ray * t, t, lens.focal / to_sample, ray, open, light) : open;
                for (int j = 0; j < surface_samples; ++j)
                    for (int i = 0; i < surface_samples; ++i) {
                        const int sx = x * surface_samples + i, sy = y * surface_samples + j;
                        const std::size_t here = static_cast<std::size_t>(sy) * width + sx;
                        result.colour[here] = colour;
                        if (nearest && nearest->solid)
                            result.depth[here] = nearest->depth(
                                lens.origin, lens.ray(static_cast<float>(sx) + 0.5f, static_cast<float>(sy) + 0.5f));
                    }
            }
    });

    const Box3f near_scene = view.bounds.cast<float>();
    const float extent = std::max(1e-6f, near_scene.diagonal().norm());
    const float near = 1e-3f * static_cast<float>((view.camera.target - view.camera.position).norm());
    for (const PictureScene::Body& body : scene.bodies) {
        if (body.role != PictureScene::Body::Collider) continue;
        const ScreenMesh mesh(*body.mesh, lens, near);
        const bool vessel = holds_points(*body.mesh, points);
        for_each_band(height, [&](int begin, int end) {
            mesh.cover(width, begin, end, [&](int x, int y, const Vec3f& w, float depth, const Triangle& triangle) {
                const std::size_t here = static_cast<std::size_t>(y) * width + x;
                if (depth >= result.depth[here]) return;
                const Corner* c = triangle.corners;
                const Vec3f P = w[0] * c[0].P + w[1] * c[1].P + w[2] * c[2].P;
                Vec3f n = (w[0] * c[0].n + w[1] * c[1].n + w[2] * c[2].n).normalized();
                const Vec3f to_eye = (lens.origin - P).normalized();
                const Vec3f face = (c[1].P - c[0].P).cross(c[2].P - c[0].P);
                const bool front = face.dot(to_eye) > 0;
                if (vessel && front) return;
                if (!front) n = -n;
                result.depth[here] = depth;
                // What is far from the scene, a floor's distant part, dissolves into the backdrop.
                const float fade = std::exp(-std::pow(near_scene.exteriorDistance(P) / extent, 2.0f));
                const Vec3f open = backdrop(x / surface_samples, y / surface_samples, options);
                result.colour[here] = open + (shade_collider(P, n, to_eye, light) - open) * fade;
            });
        });
    }
    // An emitter is where points come from, not what hides them: only its outline glows, before what is behind it.
    for (const PictureScene::Body& body : scene.bodies) {
        if (body.role != PictureScene::Body::Emitter) continue;
        const ScreenMesh mesh(*body.mesh, lens, near);
        for_each_band(height, [&](int begin, int end) {
            mesh.cover(width, begin, end, [&](int x, int y, const Vec3f& w, float depth, const Triangle& triangle) {
                const std::size_t here = static_cast<std::size_t>(y) * width + x;
                if (depth >= result.depth[here]) return;
                const Corner* c = triangle.corners;
                const Vec3f P = w[0] * c[0].P + w[1] * c[1].P + w[2] * c[2].P;
                const Vec3f n = (w[0] * c[0].n + w[1] * c[1].n + w[2] * c[2].n).normalized();
                const float facing = std::abs(n.dot((lens.origin - P).normalized()));
                result.colour[here] += emitter_glow * (0.06f + 0.5f * (1 - facing) * (1 - facing));
            });
        });
    }
    return result;
}

}  // namespace rapid

#include "runtime/picture/surfaces.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/picture/ground.h"
#include "runtime/picture/screen_mesh.h"

namespace rapid {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

// Linear colours. Dark enough that points of any colour stand out, light enough to see what they bounce off.
const Vec3f sky(0.0180f, 0.0215f, 0.0290f);      // at the upper edge
const Vec3f horizon(0.0080f, 0.0090f, 0.0115f);  // at the lower edge
const Vec3f collider_albedo(0.105f, 0.112f, 0.125f);
const Vec3f emitter_glow(0.10f, 0.085f, 0.05f);

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

class SurfacePainter {
public:
    SurfacePainter(const PictureOptions& options, const PictureScene& scene, const PictureView& view,
                   const Light& light)
        : options_(options),
          scene_(scene),
          view_(view),
          light_(light),
          surfaces_{options.width * surface_samples, options.height * surface_samples, {}, {}},
          lens_(Lens::of_camera(view.camera, surfaces_.width, surfaces_.height)),
          near_(1e-3f * static_cast<float>((view.camera.target - view.camera.position).norm())),
          near_scene_(view.bounds.cast<float>()),
          extent_(std::max(1e-6f, near_scene_.diagonal().norm()))
    {
        surfaces_.colour.resize(static_cast<std::size_t>(surfaces_.width) * surfaces_.height);
        surfaces_.depth.assign(surfaces_.colour.size(), infinite);
    }

    Surfaces draw(const PointSet& points)
    {
        draw_background();
        for (const PictureScene::Body& body : scene_.bodies)
            if (body.role == PictureScene::Body::Collider) draw_collider(*body.mesh, holds_points(*body.mesh, points));
        for (const PictureScene::Body& body : scene_.bodies)
            if (body.role == PictureScene::Body::Emitter) draw_emitter(*body.mesh);
        return std::move(surfaces_);
    }

private:
    // Backdrop and grounds, shaded once a pixel: lines on the ground are computed smooth. Depths are a sample's own.
    void draw_background()
    {
        std::vector<Ground> grounds;
        for (const PictureScene::Plane& plane : scene_.planes) {
            const Ground ground(plane, view_.bounds, true);
            if (!ground.stands_before(lens_.origin)) grounds.push_back(ground);
        }
        if (scene_.planes.empty() && options_.grid) grounds.emplace_back(PictureScene::Plane(), view_.bounds, false);
        for_each_band(options_.height, [&](int begin, int end) {
            for (int y = begin; y < end; ++y)
                for (int x = 0; x < options_.width; ++x) draw_background(x, y, grounds);
        });
    }

    void draw_background(int x, int y, const std::vector<Ground>& grounds)
    {
        constexpr float to_sample = surface_samples;
        const Vec3f ray =
            lens_.ray((static_cast<float>(x) + 0.5f) * to_sample, (static_cast<float>(y) + 0.5f) * to_sample);
        const Vec3f open = backdrop(x, y, options_);
        const Ground* nearest = nullptr;
        float t = infinite;
        for (const Ground& ground : grounds)
            if (const float depth = ground.depth(lens_.origin, ray); depth < t) t = depth, nearest = &ground;
        const Vec3f colour =
            nearest ? nearest->shade(lens_.origin + ray * t, t, lens_.focal / to_sample, ray, open, light_) : open;
        for (int j = 0; j < surface_samples; ++j)
            for (int i = 0; i < surface_samples; ++i) {
                const int sx = x * surface_samples + i, sy = y * surface_samples + j;
                const std::size_t here = static_cast<std::size_t>(sy) * surfaces_.width + sx;
                surfaces_.colour[here] = colour;
                if (nearest && nearest->solid)
                    surfaces_.depth[here] = nearest->depth(
                        lens_.origin, lens_.ray(static_cast<float>(sx) + 0.5f, static_cast<float>(sy) + 0.5f));
            }
    }

    // A sample of a mesh that nothing drawn before hides.
    struct Fragment {
        std::size_t sample;
        int x, y;  // of the sample
        float depth;
        Vec3f P, n, face;  // n: interpolated, unit; face: the triangle's normal, of any length
    };

    // Calls f(fragment) for those of a mesh.
    template <class F>
    void for_each_fragment(const Mesh& mesh, const F& f)
    {
        const ScreenMesh on_screen(mesh, lens_, near_);
        const int width = surfaces_.width;
        for_each_band(surfaces_.height, [&](int begin, int end) {
            on_screen.cover(width, begin, end,
                            [&](int x, int y, const Vec3f& w, float depth, const ScreenTriangle& triangle) {
                                const std::size_t here = static_cast<std::size_t>(y) * width + x;
                                if (depth >= surfaces_.depth[here]) return;
                                const ScreenCorner* c = triangle.corners;
                                const Vec3f P = w[0] * c[0].P + w[1] * c[1].P + w[2] * c[2].P;
                                const Vec3f n = (w[0] * c[0].n + w[1] * c[1].n + w[2] * c[2].n).normalized();
                                const Vec3f face = (c[1].P - c[0].P).cross(c[2].P - c[0].P);
                                f(Fragment{here, x, y, depth, P, n, face});
                            });
        });
    }

    // vessel: the sides towards the viewer are left out.
    void draw_collider(const Mesh& mesh, bool vessel)
    {
        for_each_fragment(mesh, [&](const Fragment& fragment) {
            const Vec3f to_eye = (lens_.origin - fragment.P).normalized();
            const bool front = fragment.face.dot(to_eye) > 0;
            if (vessel && front) return;
            const Vec3f n = front ? fragment.n : Vec3f(-fragment.n);
            surfaces_.depth[fragment.sample] = fragment.depth;
            // Far from the scene, as in the distant part of a floor, it dissolves into the backdrop.
            const float fade = std::exp(-std::pow(near_scene_.exteriorDistance(fragment.P) / extent_, 2.0f));
            const Vec3f open = backdrop(fragment.x / surface_samples, fragment.y / surface_samples, options_);
            surfaces_.colour[fragment.sample] = open + (shade_collider(fragment.P, n, to_eye, light_) - open) * fade;
        });
    }

    // An emitter shows where points come from, and must not hide them: only its outline glows, over what is behind it.
    void draw_emitter(const Mesh& mesh)
    {
        for_each_fragment(mesh, [&](const Fragment& fragment) {
            const float facing = std::abs(fragment.n.dot((lens_.origin - fragment.P).normalized()));
            surfaces_.colour[fragment.sample] += emitter_glow * (0.06f + 0.5f * (1 - facing) * (1 - facing));
        });
    }

    const PictureOptions& options_;
    const PictureScene& scene_;
    const PictureView& view_;
    const Light& light_;
    Surfaces surfaces_;
    Lens lens_;
    float near_;
    Box3f near_scene_;
    float extent_;  // m, of the scene
};

}  // namespace

Surfaces draw_surfaces(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
                       const PictureView& view, const Light& light)
{
    return SurfacePainter(options, scene, view, light).draw(points);
}

}  // namespace rapid

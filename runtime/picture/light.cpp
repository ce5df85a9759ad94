#include "runtime/picture/light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "runtime/parallel.h"
#include "runtime/picture/screen_mesh.h"

namespace rapid {
namespace {

constexpr int shadow_size = 1024;  // texels across the shadow map of the meshes
constexpr int cells = 160;         // across the shadow grid of the points
constexpr int slices = 64;         // and along the light
constexpr std::size_t slice = std::size_t{cells} * cells;

Vec3f light_direction(const Camera& camera)
{
    const Lens lens = Lens::of_camera(camera, 2, 2);
    // From above, a little from the left, and from behind the viewer: the visible sides of shapes are lit, and shadows
    // fall to the right.
    const Vec3f across = lens.right * -0.45f + Vec3f::UnitY() * 0.85f - lens.forward * 0.35f;
    return across.normalized();
}

}  // namespace

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
    mesh_depth_.assign(std::size_t{shadow_size} * shadow_size, std::numeric_limits<float>::infinity());
    for (const PictureScene::Body& body : scene.bodies) {
        if (body.role != PictureScene::Body::Collider) continue;
        const ScreenMesh mesh(*body.mesh, lens_, 0);
        for_each_band(shadow_size, [&](int begin, int end) {
            mesh.cover(shadow_size, begin, end, [&](int x, int y, const Vec3f&, float depth, const ScreenTriangle&) {
                float& nearest = mesh_depth_[static_cast<std::size_t>(y) * shadow_size + x];
                nearest = std::min(nearest, depth);
            });
        });
    }
}

void Light::gather_points(const PointSet& points, float least_radius)
{
    // Integers, so that a sum does not depend on the order in which threads add.
    constexpr float unit = 4096;
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

    blur_covered();
    for (std::size_t i = slice; i < covered_.size(); ++i) covered_[i] += covered_[i - slice];
}

// Over the neighbours, twice along each axis, so that cells do not show.
void Light::blur_covered()
{
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
}

float Light::past_meshes(const Vec3f& P, const Vec3f& n) const
{
    // A little in front of the surface, or the raster of the shadow map would show on it.
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

}  // namespace rapid

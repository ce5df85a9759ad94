#include "runtime/picture/ground.h"

#include <algorithm>
#include <cmath>

namespace rapid {
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

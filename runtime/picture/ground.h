// The ground of a picture: the planes of the scene, or a grid of lines if it has none.
#pragma once

#include <cmath>
#include <limits>

#include "runtime/picture/light.h"

namespace rapid {

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

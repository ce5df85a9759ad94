// The ground of a picture: the planes of the scene, or a grid of lines where there are none.
#pragma once

#include <cmath>
#include <limits>

#include "runtime/picture/light.h"

namespace rapid {

// A place of a surface as it is seen.
struct ShadedSample {
    Vec3f colour;  // where no point shades it
    Vec3f lamp;    // the part of that which points can take
};

// Lines on a ground plane that fade out far from the scene.
struct Ground {
    Vec3f normal, u, v;
    float offset;
    float spacing;  // m
    Vec3f scene_center;
    Vec3f center;  // of the part that is seen
    float extent;  // m from there, where lines have faded to 1/e
    bool solid;

    Ground(const PictureScene::Plane& plane, const PictureView& view, bool is_solid);

    // Where the ray meets the plane; infinite where it does not.
    float depth(const Vec3f& origin, const Vec3f& ray) const
    {
        const float towards = normal.dot(ray);
        const float t = (offset - normal.dot(origin)) / towards;
        return towards != 0 && t > 0 && std::isfinite(t) ? t : std::numeric_limits<float>::infinity();
    }

    // Whether it is a wall between the eye and the scene, seen from behind: then it is transparent.
    bool stands_before(const Vec3f& eye) const
    {
        return normal.dot(eye) < offset && normal.dot(scene_center) >= offset;
    }

    // At P, at depth t on the ray, over the colour `behind` it.
    ShadedSample shade(const Vec3f& P, float t, float focal, const Vec3f& ray, const Vec3f& behind,
                       const Light& light) const;

private:
    float line(float x, float pixel) const;
};

}  // namespace rapid

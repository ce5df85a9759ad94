// The projection from world space to a raster.
#pragma once

#include "runtime/picture/scene.h"

namespace rapid {

// Returns a unit vector perpendicular to a normal.
Vec3f any_tangent(const Vec3f& n);

// A perspective or parallel projection.
struct Lens {
    Vec3f origin, right, up, forward;  // unit vectors
    float focal;                       // samples at depth 1 m; if parallel, samples per metre
    float center_x, center_y;          // samples
    bool parallel = false;

    static Lens of_camera(const Camera& camera, int width, int height);

    // Returns x, y and depth.
    Vec3f project(const Vec3f& P) const
    {
        const Vec3f d = P - origin;
        const float depth = d.dot(forward);
        const float scale = parallel ? focal : focal / depth;
        return {center_x + scale * d.dot(right), center_y - scale * d.dot(up), depth};
    }
};

}  // namespace rapid

// Rasterises meshes: the samples that their triangles cover, with depths and barycentric weights.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

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

// Calls f(begin, end) for bands of [0, n), in parallel.
template <class F>
void for_each_band(int n, const F& f)
{
    constexpr int band = 16;
    tbb::parallel_for(0, (n + band - 1) / band, [&](int i) { f(i * band, std::min(n, (i + 1) * band)); });
}

struct ScreenCorner {
    Vec3f P, n;
    Vec3f screen = Vec3f::Zero();  // x, y and 1 / depth (depth if parallel)
};

struct ScreenTriangle {
    ScreenCorner corners[3];
    float low_y, high_y;

    float low_x() const { return std::min({corners[0].screen.x(), corners[1].screen.x(), corners[2].screen.x()}); }
    float high_x() const { return std::max({corners[0].screen.x(), corners[1].screen.x(), corners[2].screen.x()}); }
};

// A rectangle of samples: x from x0 up to but excluding x1, y likewise.
struct RasterPart {
    int x0, y0, x1, y1;
};

// The triangles of a mesh on the raster, clipped at the near plane. A corner has the normal of its vertex unless the
// face's own normal differs by more than 40°, so that edges stay sharp and round shapes round.
class ScreenMesh {
public:
    ScreenMesh(const Mesh& mesh, const Lens& lens, float near);

    const std::vector<ScreenTriangle>& triangles() const { return triangles_; }

    // Calls f(x, y, weights of the corners, depth) for every sample in the rectangle whose centre the triangle covers.
    template <class F>
    void cover(const ScreenTriangle& triangle, const RasterPart& part, const F& f) const
    {
        if (triangle.high_y < static_cast<float>(part.y0) || triangle.low_y > static_cast<float>(part.y1)) return;
        const Vec3f &a = triangle.corners[0].screen, &b = triangle.corners[1].screen, &c = triangle.corners[2].screen;
        const auto edge = [](const Vec3f& p, const Vec3f& q, float x, float y) {
            return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
        };
        const float area = edge(a, b, c.x(), c.y());
        if (area == 0) return;
        const auto clamp_to = [](float value, int low, int high) {
            return static_cast<int>(std::clamp(value, static_cast<float>(low), static_cast<float>(high)));
        };
        const int y0 = clamp_to(std::floor(triangle.low_y), part.y0, part.y1);
        const int y1 = clamp_to(std::ceil(triangle.high_y), part.y0, part.y1);
        const int x0 = clamp_to(std::floor(triangle.low_x()), part.x0, part.x1);
        const int x1 = clamp_to(std::ceil(triangle.high_x()), part.x0, part.x1);
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
                const float at_x = static_cast<float>(x) + 0.5f, at_y = static_cast<float>(y) + 0.5f;
                Vec3f weights(edge(b, c, at_x, at_y), edge(c, a, at_x, at_y), edge(a, b, at_x, at_y));
                weights /= area;
                if (weights.minCoeff() < 0) continue;
                const float z = weights.dot(Vec3f(a.z(), b.z(), c.z()));
                // Converts weights on the screen to weights on the triangle.
                if (!lens_.parallel) weights = weights.cwiseProduct(Vec3f(a.z(), b.z(), c.z())) / z;
                f(x, y, weights, lens_.parallel ? z : 1 / z);
            }
    }

private:
    void add(const ScreenCorner& a, const ScreenCorner& b, const ScreenCorner& c);
    void add_clipped(const ScreenCorner (&corners)[3]);

    const Lens& lens_;
    float near_;
    std::vector<ScreenTriangle> triangles_;
};

}  // namespace rapid

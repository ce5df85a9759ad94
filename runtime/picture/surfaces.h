// The part of a picture that is not points: background, ground, the meshes of the scene, their light and shadows.
#pragma once

#include <vector>

#include "runtime/picture/picture.h"

namespace rapid {

// Samples along each edge of a pixel: surfaces are drawn that much larger, and averaged.
constexpr int surface_samples = 2;

// From the world to a raster, by perspective or along parallel rays.
struct Lens {
    Vec3f origin, right, up, forward;  // unit vectors
    float focal;                       // samples at depth 1 m; of parallel rays: samples a metre
    float center_x, center_y;          // samples
    bool parallel = false;

    static Lens of_camera(const Camera& camera, int width, int height);

    // x, y and depth.
    Vec3f project(const Vec3f& P) const
    {
        const Vec3f d = P - origin;
        const float depth = d.dot(forward);
        const float scale = parallel ? focal : focal / depth;
        return {center_x + scale * d.dot(right), center_y - scale * d.dot(up), depth};
    }
    // Through the raster's point x, y; not normalised: a metre of depth long. Perspective alone.
    Vec3f ray(float x, float y) const
    {
        return forward + right * ((x - center_x) / focal) + up * ((center_y - y) / focal);
    }
};

// A lamp at infinity that casts shadows: of meshes on everything, and of points on each other and on what is below.
class Light {
public:
    Light(const PointSet& points, const PictureOptions& options, const PictureScene& scene, const PictureView& view);

    const Vec3f& direction() const { return direction_; }  // to the lamp
    // The part of the light that no mesh takes away at P; for a surface's own place, `n` is its normal, else 0.
    float past_meshes(const Vec3f& P, const Vec3f& n) const;
    // The part that the points between the lamp and P leave.
    float past_points(const Vec3f& P) const;

private:
    void draw_meshes(const PictureScene& scene);
    void gather_points(const PointSet& points, float least_radius);

    Vec3f direction_;
    Lens lens_;
    float depth_range_;              // m, of what is lit
    std::vector<float> mesh_depth_;  // of the nearest mesh, shape [shadow_size][shadow_size]
    // How often points cover a cell's cross section, summed from the lamp to the cell's far side; shape [slices][size]
    // [size] over the same square.
    std::vector<float> covered_;
};

// Linear colours and depths, shape [height][width] in samples.
struct Surfaces {
    int width, height;
    std::vector<Vec3f> colour;
    std::vector<float> depth;  // m; infinite where there is nothing
};

Surfaces draw_surfaces(const PointSet& points, const PictureOptions& options, const PictureScene& scene,
                       const PictureView& view, const Light& light);

}  // namespace rapid

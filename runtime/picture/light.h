// The light of a picture, and the shadows that it casts.
#pragma once

#include <vector>

#include "runtime/picture/lens.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Of the light that reaches an open place; the rest is the lamp's.
constexpr float light_from_sky = 0.30f;

// A lamp at infinity that casts shadows: of meshes on everything, and of points on each other and on what is below.
class Light {
public:
    Light(const PointSet& points, const PictureOptions& options, const PictureScene& scene, const PictureView& view);

    const Vec3f& direction() const { return direction_; }  // to the lamp
    // The part of the light at P that passes the meshes; n: the normal where P is on a surface, else 0.
    float past_meshes(const Vec3f& P, const Vec3f& n) const;
    // The part that passes the points between the lamp and P.
    float past_points(const Vec3f& P) const;

private:
    void draw_meshes(const PictureScene& scene);
    void gather_points(const PointSet& points, float least_radius);
    void blur_covered();

    Vec3f direction_;
    Lens lens_;
    float depth_range_;              // m, of the lit region
    std::vector<float> mesh_depth_;  // of the nearest mesh, shape [shadow_size][shadow_size]
    // How often points cover a cell's cross section, summed from the lamp to the cell's far side; shape [slices][size]
    // [size] over the same square.
    std::vector<float> covered_;
};

}  // namespace rapid

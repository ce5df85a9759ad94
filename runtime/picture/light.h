// The light of a picture and its shadows.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/picture/screen_mesh.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Fraction of the light at an unshaded position that comes from the sky. The rest comes from the lamp.
constexpr float light_from_sky = 0.30f;

// A lamp at infinity that casts shadows: of meshes on everything, of points on each other and on surfaces. Create one
// for a view and its shapes. The points' shadows are gathered again for each frame.
class Light {
public:
    Light(const PictureScene& scene, const PictureView& view);

    const Vec3f& direction() const { return direction_; }  // to the lamp
    // Returns the fraction of light at P that passes the meshes. n: the normal if P is on a surface, else 0.
    float mesh_transmittance(const Vec3f& P, const Vec3f& n) const;

    // Gathers the points' shadows. opacity: light that each point blocks, 0 to 1; shape [points.size()], or empty if
    // all are opaque. min_radius: minimum radius at which points are drawn, m.
    void gather(const PointSet& points, std::span<const float> opacity, float min_radius);

    // Returns the position of P in the shadow grid of the points.
    Vec3f cell_of(const Vec3f& P) const;
    // Returns the fraction of light that passes the points between the lamp and a position in the grid.
    float point_transmittance(const Vec3f& cell) const;
    // Returns the same at a gathered point, excluding the point itself: a ball casts no shadow on its own centre.
    float transmittance_of_others(const Vec3f& P, float radius, float taken) const;
    // Returns true if any position in this box of the grid may be shaded.
    bool may_shade(const Box3f& box) const;

private:
    void draw_meshes(const PictureScene& scene);
    void blur_covered();
    float point_transmittance(const Vec3f& cell, float own, int own_slice) const;

    // The cells that points cover, including those that the blur reaches. Empty if begin = end.
    struct Range {
        int begin = 0, end = 0;
        void extend(int low, int high);
    };

    Vec3f direction_;
    Lens lens_;
    float depth_range_;              // depth of the lit region, m
    float min_radius_ = 0;           // m, as passed to gather()
    std::vector<float> mesh_depth_;  // nearest mesh depth, shape [shadow_size][shadow_size]; empty without meshes
    // How many times points cover a cell's cross section, summed from the lamp to the cell's far side; shape
    // [slices][size] [size] over the same square. The sums use integers, so that they do not depend on the order of
    // threads.
    std::vector<float> covered_, spread_;
    std::unique_ptr<std::atomic<std::uint64_t>[]> sums_;
    Range x_, y_, z_;
};

}  // namespace rapid

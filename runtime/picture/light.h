// The light of a picture, and the shadows that it casts.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/picture/lens.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Of the light that reaches an open place; the rest is the lamp's.
constexpr float light_from_sky = 0.30f;

// A lamp at infinity that casts shadows: of meshes on everything, and of points on each other and on what is below.
// Made for a view and its shapes; the points' shadows are gathered anew for each frame.
class Light {
public:
    Light(const PictureScene& scene, const PictureView& view);

    const Vec3f& direction() const { return direction_; }  // to the lamp
    // The part of the light at P that passes the meshes; n: the normal where P is on a surface, else 0.
    float past_meshes(const Vec3f& P, const Vec3f& n) const;

    // opacity: how much light a point takes, from 0 to 1; shape [points.size()], or empty where all are opaque.
    // least_radius: m, that points are seen with at least.
    void gather(const PointSet& points, std::span<const float> opacity, float least_radius);

    // The place of P among the cells of the points' shadows.
    Vec3f cell_of(const Vec3f& P) const;
    // The part of the light that passes the points between the lamp and such a place.
    float past_points(const Vec3f& cell) const;
    // The same at a point that has been gathered, by all others: a ball casts no shadow on its own middle.
    float past_other_points(const Vec3f& P, float radius, float taken) const;
    // Whether any place in the box of cells may be in their shadow.
    bool may_shade(const Box3f& box) const;

private:
    void draw_meshes(const PictureScene& scene);
    void blur_covered();
    float past_points(const Vec3f& cell, float own, int own_slice) const;

    // The cells that points cover, with those that the blur reaches: of none, begin = end.
    struct Range {
        int begin = 0, end = 0;
        void extend(int low, int high);
    };

    Vec3f direction_;
    Lens lens_;
    float depth_range_;              // m, of the lit region
    float least_radius_ = 0;         // m, of the points that were gathered
    std::vector<float> mesh_depth_;  // of the nearest mesh, shape [shadow_size][shadow_size]; empty: no meshes
    // How often points cover a cell's cross section, summed from the lamp to the cell's far side; shape [slices][size]
    // [size] over the same square. Integers while they are summed: a sum does not depend on the order of threads.
    std::vector<float> covered_, spread_;
    std::unique_ptr<std::atomic<std::uint64_t>[]> sums_;
    Range x_, y_, z_;
};

}  // namespace rapid

// The free paths of a block of points in one sub-step among colliders: where each ends, and which of them may come near
// a box.
//
// Most points meet nothing in a sub-step, so this is what a collider costs them: a few operations on packs. Why beside
// the ballistic batch: accelerations may differ from point to point, and states stay in double precision.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/vec.h"

namespace rapid {

class FreePaths {
public:
    // Shapes [n]; m, m/s, m/s², s. The accelerations are constant within the sub-step.
    void begin(std::span<const Vec3d> P, std::span<const Vec3d> v, Strided<Vec3d> a, std::span<const double> dt);

    // For a point whose state at the end is not that of its parabola.
    void end_with(std::size_t i, const Vec3d& P, const Vec3d& v)
    {
        P_[i] = P;
        v_[i] = v;
    }

    // Swaps the states at the end with those at the beginning.
    void exchange(std::span<Vec3d> P, std::span<Vec3d> v);

    // The states held here: at the end, and after exchange() at the beginning.
    const Vec3d& P(std::size_t i) const { return P_[i]; }
    const Vec3d& v(std::size_t i) const { return v_[i]; }

    // The points, in order, whose path may come within `radius` of the box, by their bounding boxes.
    void find_near(const Box3d& box, double radius, std::vector<std::uint32_t>& near) const;

private:
    std::size_t size_ = 0;
    // Padded to whole packs of points; the last point is repeated.
    std::vector<Vec3d> P_, v_;
    std::vector<Vec3d> lowest_, highest_;  // corners of the bounding boxes of the paths
    Box3d bounds_;                         // of all paths
};

}  // namespace rapid

// The free paths of a block of points in one substep among colliders: their ends, and which of them may come near a
// box.
//
// Most points meet nothing in a substep, so the cost of a collider is mainly these few operations on packs. This
// exists alongside the ballistic batch because accelerations may differ between points, and states stay in double
// precision.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/column.h"

namespace rapid {

class FreePaths {
public:
    // Shapes [n]; m, m/s, m/s², s. The accelerations are constant within the substep.
    void begin(std::span<const Vec3d> P, std::span<const Vec3d> v, Strided<Vec3d> a, std::span<const double> dt);

    // Replaces the end of a point whose final state is not that of its parabola.
    void end_with(std::size_t i, const Vec3d& P, const Vec3d& v)
    {
        P_[i] = P;
        v_[i] = v;
    }

    // Swaps the final states with the initial ones.
    void exchange(std::span<Vec3d> P, std::span<Vec3d> v);

    // The stored states: final, and initial after exchange().
    const Vec3d& P(std::size_t i) const { return P_[i]; }
    const Vec3d& v(std::size_t i) const { return v_[i]; }

    // Appends the points whose path may come within `radius` of the box, by their bounding boxes, in order.
    void find_near(const Box3d& box, double radius, std::vector<std::uint32_t>& near) const;

private:
    std::size_t size_ = 0;
    // Padded to whole packs of points by repeating the last point.
    std::vector<Vec3d> P_, v_;
    std::vector<Vec3d> lowest_, highest_;  // corners of the bounding boxes of the paths
    Box3d bounds_;                         // of all paths
};

}  // namespace rapid

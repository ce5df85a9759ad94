// The free paths of a block of points in one sub-step: where each ends, and which of them may come near a box.
//
// Most points meet nothing in a step, so this is what a collider costs them: a few vector operations.
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

    // For a point whose state at the end is another than that of its path.
    void end_with(std::size_t i, const Vec3d& P, const Vec3d& v)
    {
        P_.segment<3>(3 * i) = P;
        v_.segment<3>(3 * i) = v;
    }

    // Gives the states at the end for those at the beginning.
    void exchange(std::span<Vec3d> P, std::span<Vec3d> v);

    // The state that it has: at the end, and after exchange() at the beginning.
    Vec3d P(std::size_t i) const { return P_.segment<3>(3 * i); }
    Vec3d v(std::size_t i) const { return v_.segment<3>(3 * i); }

    // The points, in order, that may come within `radius` of the box on their way, or have begun there: by the boxes
    // around their paths, and with what rounding a position to single precision can do.
    void find_near(const Box3d& box, double radius, std::vector<std::uint32_t>& near) const;

private:
    std::size_t size_ = 0;
    // By coordinate: x y z x y z ..., so that the loops over them are vectors.
    Eigen::ArrayXd P_, v_;
    Eigen::ArrayXd lowest_, highest_;  // of the boxes around the paths; whole periods of them
    Eigen::ArrayXd t_, gain_;          // duration, and change of velocity
    Box3d bounds_;                     // of all paths
};

}  // namespace rapid

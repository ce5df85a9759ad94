// A block of points within a frame: their state in double precision, the acceleration of the substep, and motion
// without contacts. This exists alongside the free paths (motion/free_paths.h) because a substep without obstacles
// needs neither the boxes of paths nor a copy of the states.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/solver/forces.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/solver/motion/damped_motion.h"

namespace rapid {

// All arrays are by point of the block, shape [size].
class PointBlock {
public:
    // Begins with the points at these indices of the set, whose columns are P0 and v0, before `count` substeps.
    void begin(std::span<const std::uint32_t> block_indices, std::span<const Vec3f> P0, std::span<const Vec3f> v0,
               const OwnTime& time, int count);

    std::size_t size() const { return P.size(); }

    // Applies free motion over the times t (s), without linear forces.
    void drift(std::span<const double> t);
    // The same with linear forces.
    void drift_damped(std::span<const double> t);
    // The paths with linear forces, for colliders: fills `damped`.
    void find_damped_paths(std::span<const double> t);

    std::span<const std::uint32_t> indices;  // in the set
    int substeps = 1;
    std::vector<Vec3d> P, v;
    std::vector<Vec3f> rounded;    // P at the beginning of the frame, and at its end
    std::vector<double> dt;        // s, the substep of each point
    std::vector<double> moved_dt;  // s, the part of dt in which it moves: 0 for sleeping and dead points

    // Accelerations and linear force terms for this substep. linear is null if no force contributes one. Either one
    // value for all points, or own_a and own_linear.
    Strided<Vec3d> a{nullptr, 0};
    Strided<Linear> linear{nullptr, 0};
    std::vector<Vec3d> own_a;
    std::vector<Linear> own_linear;
    std::vector<Damped> damped;

    // m/s: velocity changes due to shapes in the substep. Empty unless requested.
    std::vector<Vec3d> reaction;

private:
    void drift_dragged(std::span<const double> t);
    bool has_springs() const;

    std::vector<double> rates_;  // 1/s, of all drag
    DragPropagators dragged_;
};

}  // namespace rapid

// Springs to the surfaces of shapes, for the points of a block (motion/surface_motion.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/forces.h"
#include "runtime/solver/motion/surface_motion.h"
#include "runtime/solver/point_block.h"

namespace rapid {

// The potential energy of springs to the surfaces of shapes, and how these move.

// J/kg, of a point at P: w2 φ²/2, with the distance φ of the shape at the spring's time, as far as its gradient tells
// it.
double potential_energy(const SurfaceSpring& spring, const Vec3d& P);
// m/s: of the shape at P, so many seconds before the spring's time.
Vec3d velocity_of_surface(const SurfaceSpring& spring, const Vec3d& P, double before);

class SurfaceSprings {
public:
    // Of a block of so many points.
    void begin(std::size_t size)
    {
        size_ = size;
        indices_.clear();
    }
    bool empty() const { return indices_.empty(); }
    // That of point i of the block which is not in its `linear`.
    SurfaceSpring of(std::size_t i) const { return indices_.empty() ? SurfaceSpring() : springs_[i]; }

    // Of point i of the block, at P. Of several the stiffest is taken as above, the others as springs to the nearest
    // place, half a step of dt (s) on where that moves, which are added to `linear`: they are of order 1, and give no
    // energy either.
    void add(std::size_t i, const SurfaceSpring& spring, const Vec3d& P, double dt, Linear& linear);

    // The states of these points after the times t (s) from where the block has them. Springs are then at that time.
    void advance(const PointBlock& block, std::span<const double> t);
    // Moves the points there.
    void move(PointBlock& block) const;
    // Has the damped paths of these points end there.
    void bend(std::span<Damped> paths) const;

private:
    void query();
    Vec3d shape_velocity(std::size_t m) const;

    std::size_t size_ = 0;
    std::vector<SurfaceSpring> springs_;  // by point of the block, once one has any
    std::vector<std::uint32_t> indices_;  // points that have one, in order
    std::vector<SurfaceMotion> motions_;  // of these
    std::vector<Vec3d> at_, gradient_;
    std::vector<double> phi_, times_;  // times_: of the shape, s

    std::vector<Vec3d> asked_, asked_gradient_;  // of one shape
    std::vector<double> asked_phi_, asked_times_;
};

}  // namespace rapid

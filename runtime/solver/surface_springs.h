// Springs to the surfaces of shapes, for the points of a block (motion/surface_motion.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/forces.h"
#include "runtime/solver/motion/surface_motion.h"
#include "runtime/solver/point_block.h"

namespace rapid {

// The potential energy of springs to the surfaces of shapes, and the velocities of the surfaces.

// Returns the potential energy of a point at P, J/kg: w2 φ²/2, with the shape's distance φ at the spring's time, if
// its gradient is defined.
double potential_energy(const SurfaceSpring& spring, const Vec3d& P);
// Returns the velocity of the shape at P, m/s, `before` seconds before the spring's time.
Vec3d velocity_of_surface(const SurfaceSpring& spring, const Vec3d& P, double before);

class SurfaceSprings {
public:
    // Begins a block of this size.
    void begin(std::size_t size)
    {
        size_ = size;
        indices_.clear();
    }
    bool empty() const { return indices_.empty(); }
    // Returns the spring of point i of the block that is not part of its `linear`.
    SurfaceSpring of(std::size_t i) const { return indices_.empty() ? SurfaceSpring() : springs_[i]; }

    // Adds a spring of point i of the block, at P. The stiffest of several is solved as above. The others become
    // springs to the nearest position, moved on by half a step of dt (s), and are added to `linear`: they are of order
    // 1, and do not add energy either.
    void add(std::size_t i, const SurfaceSpring& spring, const Vec3d& P, double dt, Linear& linear);

    // Computes the states after the times t (s) from the block's states. Springs are then at that time.
    // time.
    void advance(const PointBlock& block, std::span<const double> t);
    // Moves the points there.
    void move(PointBlock& block) const;
    // Makes the damped paths end at the computed states.
    void bend(std::span<Damped> paths) const;

private:
    void query();
    Vec3d shape_velocity(std::size_t m) const;

    std::size_t size_ = 0;
    std::vector<SurfaceSpring> springs_;  // by point of the block, if any point has one
    std::vector<std::uint32_t> indices_;  // points with a spring, in order
    std::vector<SurfaceMotion> motions_;  // by indices_
    std::vector<Vec3d> at_, gradient_;
    std::vector<double> phi_, times_;  // times_: of the shape, s

    std::vector<Vec3d> queried_, query_gradient_;  // for one shape
    std::vector<double> query_phi_, query_times_;
};

}  // namespace rapid

// The substeps of one block of points: forces, motion among the colliders, actions.
//
//   no actions     x(t + dt) by the forces at the middle of the substep
//   with actions   half a drift, all actions, half a drift: second order (numerics.md, Motion)
//
// This exists alongside the ballistic batch, which needs no substeps, because forces that vary between points, actions
// and contacts have no closed form for the whole frame.
#pragma once

#include <span>
#include <vector>

#include "runtime/solver/point_block.h"
#include "runtime/solver/step_context.h"
#include "runtime/solver/surface_springs.h"

namespace rapid {

// One object serves many blocks in turn and reuses their arrays.
class BlockStep {
public:
    explicit BlockStep(StepContext& context) : context_(context) {}

    PointBlock block;

    // Begins with the points at these indices of the set, in order; they must be contiguous if forces or actions act.
    void begin(std::span<const std::uint32_t> indices, int substeps)
    {
        block.begin(indices, context_.P, context_.v, context_.time, substeps);
    }

    // Advances one substep, numbered from 0. The collisions must have begun this block.
    void advance(Collisions& collisions, int substep);

    // Returns the spring of point k in the substep; w2 is 0 if it has none.
    SurfaceSpring surface_spring(std::size_t k) const { return surface_springs_.of(k); }

    // Are called at the end of the frame, after block.rounded is set. The check precedes storing, because the message
    // reports the earlier state.
    void require_finite() const;
    void store() const;

private:
    void add_forces(int substep);
    bool add_uniform_forces(int substep);
    void add_force_attribute();
    void add_accelerations(const StepForce& local);
    void add_linear(const StepForce& local);
    void add_surface_springs(const StepForce& local);
    void own_linear();
    void drift(Collisions& collisions, std::span<const double> dt, double halves_after);
    void drift_among_others(Collisions& collisions, std::span<const double> dt, double halves_after);
    void find_free_velocities(std::span<const double> dt);
    void add_reactions();
    void act(int substep);
    void stop_dead();
    void set_time(int substep);
    Vec3d acceleration_by(const Vec3d& force, std::size_t point) const
    {
        return context_.errors.acceleration(point, force, context_.scene.mass[point]);
    }

    StepContext& context_;
    std::vector<double> half_, after_, time_;  // s
    std::vector<Vec3d> middle_, kick_;         // m, N
    std::vector<Vec3d> free_;                  // m/s
    std::vector<std::uint8_t> dead_before_;    // before the actions, if deaths are logged
    Forces one_;                               // from one Force
    Uniform uniform_;                          // the sum of all forces if they are uniform in the substep
    SurfaceSprings surface_springs_;
};

}  // namespace rapid

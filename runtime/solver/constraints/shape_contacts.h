// Contacts with shapes within the projection: shapes keep out points that other constraints push into them.
//
// The free motion of a point has been taken around all shapes before (collisions.h); what is left to a shape here is
// what the other points press on it: along the normal, and by Coulomb friction of that. A contact is
// C = n·x - level >= 0, with the shape's tangent plane where the point's free motion ended; at the end of the sub-step
// what is inside of the shape itself is moved out.
//
// Each sub-step begins with the impulses of the one before, across frames too: a pile at rest is then solved before it
// is iterated.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/shape_clearance.h"

namespace rapid {

// What shapes bore at the end of a frame: the warm start of the next.
struct ShapeLoads {
    struct Load {
        std::int64_t id;
        std::uint32_t obstacle;
        float normal;   // N
        Vec3f tangent;  // N
        Vec3f rolling;  // N: torque / radius
    };
    std::vector<Load> loads;
};

class ShapeContacts {
public:
    // sleep: null where no point may sleep.
    ShapeContacts(std::span<const Obstacle> obstacles, std::size_t size, const Sleep* sleep);

    void recall(const ShapeLoads& loads, const Column<std::int64_t>& ids, double dt);
    void remember(ShapeLoads& loads, const Column<std::int64_t>& ids, const Substep& step) const;

    // free: where the points' free motion has ended.
    void detect(const Substep& step, std::span<const Vec3d> free);
    // One sweep, over the points that others hit in this one or in that before.
    void solve_impacts(Substep& step, std::uint32_t sweep);
    void warm_start(Substep& step);
    void project(Substep& step);
    void solve_velocities(Substep& step);
    // To step.forces: with what shapes did to points in their free motion.
    void add_forces(const Substep& step) const;
    // Shapes drive the points that they bear.
    void drive(EnergyIslands& islands, const Substep& step) const;

private:
    struct ShapeContact {
        std::uint32_t i, obstacle;
        Vec3d n, vc;                    // unit normal out of the shape; its velocity, m/s
        double level;                   // m: on the shape's outer side n·x is more
        double friction;                // μ
        double normal_impulse;          // N s along n: at first of the projection of positions, then the whole
        double carried_impulse;         // N s along n: that the warm start gives to velocities alone
        Vec3d turning = Vec3d::Zero();  // rad/s, of the shape; 0 for points that do not turn
        Vec3d tangential_impulse = Vec3d::Zero();  // N s along the surface
        Vec3d rolling_impulse = Vec3d::Zero();     // N s: torque / radius, of rolling friction
        // N s: what the shape did in the free motion, along n and along the surface. Known where Substep::reaction is.
        double free_impulse = 0;
        Vec3d free_friction = Vec3d::Zero();
    };
    using Batch = std::vector<ShapeContact>;  // of a chunk of points, by obstacle and then by point
    static bool is_before(const ShapeContact& a, const ShapeContact& b)
    {
        return std::pair(a.obstacle, a.i) < std::pair(b.obstacle, b.i);
    }

    void find(Batch& contacts, const Batch& before, const Substep& step, std::span<const Vec3d> free, std::size_t begin,
              std::size_t end);
    ShapeContact contact(const ShapeQuery& query, std::size_t k, std::size_t obstacle, const Substep& step) const;
    void follow_turning(ShapeContact& contact, const Vec3d& P, double time) const;
    void keep_of_sleepers(Batch& contacts, std::size_t begin, const Batch& before, std::size_t obstacle) const;
    void solve_impact(const ShapeContact& contact, Substep& step, std::uint32_t sweep) const;
    void share_reactions(const Substep& step);
    void share_reaction(std::span<ShapeContact* const> contacts, std::uint32_t i, const Substep& step,
                        Batch& missed) const;
    std::optional<ShapeContact> missed_contact(std::uint32_t i, const Vec3d& impulse, const Substep& step) const;
    static void start_spinning(ShapeContact& contact, Substep& step);
    static void solve_spinning(ShapeContact& contact, Substep& step);
    static void leave_parting(ShapeContact& contact, const Substep& step);
    static void solve_velocity(ShapeContact& contact, Substep& step);
    void move_out(const Batch& contacts, Substep& step) const;

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    const Sleep* sleep_;
    ShapeClearance clearance_;
    std::vector<Batch> contacts_, before_;  // a chunk of points each
};

}  // namespace rapid

// The free motion of a block's points in a substep: along a parabola, or under forces with linear parts along the
// parabola that represents their damped motion.
#pragma once

#include <span>
#include <vector>

#include "runtime/shapes/shape.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/motion/damped_motion.h"
#include "runtime/solver/motion/free_paths.h"
#include "runtime/solver/surface_springs.h"

namespace rapid {

// One substep, or part of it, for all points of a block.
struct Drift {
    Strided<Vec3d> a;                // m/s², constant within it
    std::span<const double> dt;      // s
    std::span<const double> after;   // s, from its end to the end of the frame
    std::span<const Damped> damped;  // if not empty, replaces a
};

class FreeMotion {
public:
    explicit FreeMotion(const CollisionBlock& block) : block_(block) {}

    void begin(const Drift& drift);
    bool is_damped() const { return !damped_.empty(); }

    // Returns the acceleration without the forces of surfaces, m/s²; with damping, the mean over the rest of the
    // substep.
    const Vec3d& acceleration(std::size_t i) const { return a_[i]; }
    // is_drawn() returns true if a spring acts on a damped point; is_drawn_to_surface() if the spring attaches to a
    // surface.
    bool is_drawn(std::size_t i) const { return damped_[i].pull.w2 > 0 || is_drawn_to_surface(i); }
    bool is_drawn_to_surface(std::size_t i) const { return damped_[i].pull.surface.w2 > 0; }
    // Returns the potential energy of the springs and constant force on a damped point at P, up to a constant, J/kg.
    double potential(std::size_t i, const Vec3d& P) const
    {
        const Damped::Pull& pull = damped_[i].pull;
        const Vec3d d = P - initial_P(i);
        const double surface = pull.surface.w2 > 0 ? potential_energy(pull.surface, P) : 0;
        return 0.5 * pull.w2 * d.squaredNorm() - pull.G.dot(d) + surface;
    }
    // Returns the velocity at P of the shape to which a spring attaches the point, m/s.
    Vec3d frame_velocity(std::size_t i, const Vec3d& P) const
    {
        const SurfaceSpring& spring = damped_[i].pull.surface;
        if (!(spring.w2 > 0) || !spring.shape->moves()) return Vec3d::Zero();
        return spring.shape->velocity_at(P, spring.time + 0.5 * block_.dt[i]);
    }
    // Returns the change in potential energy between two positions, J/kg; `from` is the beginning of the substep.
    double potential_change(std::size_t i, const Vec3d& from, const Vec3d& to) const
    {
        const Damped::Pull& pull = damped_[i].pull;
        const Vec3d d = to - from;
        double change = 0.5 * pull.w2 * d.squaredNorm() - pull.G.dot(d);
        if (pull.surface.w2 > 0) change += potential_energy(pull.surface, to) - potential_energy(pull.surface, from);
        return change;
    }
    bool is_dragged(std::size_t i) const { return damped_[i].k > 0; }
    // Returns the springs and constant force on a damped point.
    const Damped::Pull& pull(std::size_t i) const { return damped_[i].pull; }
    // Updates the mean acceleration from the current velocity of the point.
    void update_acceleration(std::size_t i, double left)
    {
        if (is_damped()) mean_a_[i] = damped_[i].mean_acceleration(block_.v[i], left);
    }

    // Returns the part of `left`, s, that the mean acceleration may represent.
    double longest_parabola(std::size_t i, double left) const
    {
        return is_damped() ? damped_[i].longest_parabola(block_.v[i], left) : left;
    }

    // Traces the free paths of all points from their current positions.
    void trace();
    FreePaths& paths() { return paths_; }
    Path path(std::size_t i, double radius = 0) const;
    Vec3d velocity_after(std::size_t i, double s) const;

    // Move all points to the ends of their paths, and one of them back.
    void go_to_ends() { paths_.exchange(block_.P, block_.v); }
    void go_back(std::size_t i)
    {
        block_.P[i] = initial_P(i);
        block_.v[i] = initial_v(i);
    }
    // The state at the beginning of the path, after go_to_ends().
    Vec3d initial_P(std::size_t i) const { return paths_.P(i); }
    Vec3d initial_v(std::size_t i) const { return paths_.v(i); }

private:
    const CollisionBlock& block_;
    Strided<Vec3d> a_{nullptr, 0};
    FreePaths paths_;

    // By point, if a force has a linear part; a_ then points to mean_a_.
    std::span<const Damped> damped_;
    std::vector<Vec3d> path_v_, path_a_, mean_a_;
};

}  // namespace rapid

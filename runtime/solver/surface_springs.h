// Springs to the surfaces of shapes, for the points of a block (solver/surface_springs.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/solver/forces.h"
#include "runtime/solver/point_block.h"

namespace rapid {

// The motion of a point on a spring to the surface of a shape, over one step:
//
//   x'' = G - k x' - w2 (x - x0) - s φ ∇φ
//
// With the unit normal n = ∇φ and the distance d = φ(x), and u the velocity along the surface,
//
//   d'' = n·G + u·n' - k d' - s d                 u·n': centrifugal
//   u'  = G - (n·G) n - k u - d' n'               in the frame that turns with n
//
// The first is a damped oscillator, solved exactly with n and n' from the middle of the step (0 on a plane). The point
// is then placed at the distance d, and u gets the magnitude that the remaining energy allows: without drag ½v² + ½ s
// d² - G·x is conserved to rounding for any s dt², with drag it never grows. Exact for planes, otherwise of second
// order. A fixed nearest point would instead pull points back that move along the surface.
//
// A moving shape is at rest in the frame that moves from V0 to V1, its velocities at the positions where the point
// starts and arrives. In that frame u and d' are velocities, and G - (V1 - V0)/t - k V - w2 V t/2 with the mean V
// replaces G.
struct SurfaceMotion {
    Vec3d P0, v0;            // at the beginning
    double t;                // s
    double k;                // 1/s
    double w2, s;            // 1/s²: of other springs, and of this one, which is above 0
    Vec3d G;                 // m/s², of everything except the surface spring, at rest at P0
    bool two_sided = false;  // the distance is above 0 on both sides of the surface

    Vec3d P, v;  // at the end

    // Call in this order, each with the distance and its gradient at the position that the previous call returned;
    // begin() with those at P0. The gradient is zero if the shape gives no direction; the spring then does not act. V:
    // velocity of the shape at that position.
    Vec3d begin(double phi, const Vec3d& gradient, const Vec3d& V);
    Vec3d advance(const Vec3d& gradient, const Vec3d& V);
    void end(double phi, const Vec3d& gradient);
    // Returns true if the end may lie beyond a turning point of the distance, such as the middle of a ball. A query at
    // the end, passed to settle(), then corrects the energy to the shape's actual distance.
    bool far_from_query() const { return acts_ && std::abs(moved_) > 0.1 * std::abs(d1_ - d0_); }
    void settle(double phi, const Vec3d& gradient);

    // Returns the initial velocity of the parabola that represents the path; it starts along the surface.
    Vec3d path_v() const;

private:
    // Returns twice the kinetic energy left at a position with this distance, J/kg; below 0 if the energy does not
    // suffice.
    double energy_left(const Vec3d& position, double distance) const;
    std::optional<double> distance_reached(const Vec3d& surface, const Vec3d& n) const;
    Vec3d mean_V() const { return 0.5 * (V0_ + V1_); }
    bool turns_away(const Vec3d& gradient) const { return two_sided && gradient.dot(n_) < 0; }

    Vec3d at_ = Vec3d::Zero();                         // position of the last distance query
    Vec3d n0_ = Vec3d::Zero(), n_ = Vec3d::Zero();     // unit normals, at the beginning and of the middle
    double d0_ = 0, d1_ = 0;                           // m
    double moved_ = 0;                                 // m, along the normal, from the last distance query
    double normal_v_ = 0;                              // m/s, d' at the end
    Vec3d tangential_ = Vec3d::Zero();                 // m/s, at the end, perpendicular to n_
    Vec3d V0_ = Vec3d::Zero(), V1_ = Vec3d::Zero();    // m/s, of the shape
    Vec3d u0_ = Vec3d::Zero(), pull_ = Vec3d::Zero();  // v0 and G in the shape's frame
    bool acts_ = true;
};

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

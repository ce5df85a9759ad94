// Spin: points that turn, as solid spheres of the moment of inertia I = 2/5 m r² about their middles.
//
// Kept is the speed of the surface, s = r ω: friction needs no radius in it. With n from the contact to the middle, a
// contact at -r n moves by v + n × s, and an impulse q there does
//
//   Δv = w q,   Δs = -k w n × q,   k = m r²/I = 5/2,   w = 1/m
//
// so that the sliding velocity u of a pair, and what an impulse across n does to it, are
//
//   u = v_i - v_j + n × (s_i + s_j),   Δu = (w_i + w_j + k_i w_i + k_j w_j) q
//
// Friction is Coulomb's on u. Rolling friction is a torque against the relative angular velocity, of at most μ_r N R
// with 1/R = 1/r_i + 1/r_j (Ai et al. 2011, model A), solved as an impulse too: a ball that it holds rests.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/vec.h"

namespace rapid {

struct Substep;

struct Spin {
    Vec3d s = Vec3d::Zero();  // m/s: r ω
    double k = 0;             // 5/2; 0 of points that do not turn
    double radius = 0;        // m
    double rolling = 0;       // μ_r

    double kinetic_energy(double mass) const { return k > 0 ? 0.5 * mass / k * s.squaredNorm() : 0; }
    Vec3d angular_momentum(double mass) const { return k > 0 ? Vec3d(mass * radius / k * s) : Vec3d(Vec3d::Zero()); }
};

// The turning of a set of points over a frame: from the columns `w` (rad/s) and `orient`, and back.
class SpinState {
public:
    static constexpr const char* names[] = {"orient", "w"};

    // Points with a radius turn by what this contact says of them. Error: w is not finite.
    void include(const PointSet& points, const ContactMaterial& material);

    std::span<Spin> spins() { return spins_; }
    // Before a sub-step, and after it: turns the orientations by exp(ω dt), with the mean of ω.
    void begin() { before_ = spins_; }
    void turn(const OwnTime& time, int substeps);
    void store(PointSet& points) const;

private:
    std::vector<Spin> spins_, before_;
    std::vector<Eigen::Quaterniond> orient_;
};

// The impulse of an impact, N s on i, with what its friction does to both spins. u: relative velocity of the middles at
// the time of impact; lever: their distance as a part of the sum of the radii, at which friction acts.
Vec3d spinning_impact(Substep& step, std::uint32_t i, std::uint32_t j, const Vec3d& n, const Vec3d& u, double lever,
                      double restitution, double friction);
// The same of a point and a shape that moves; w: 1/kg.
Vec3d spinning_impact(Spin& spin, double w, const Vec3d& n, const Vec3d& u, double restitution, double friction);

// What the warm start of a pack's friction does to spins; rolling: N m s on the first point, of all pairs.
void start_spins(const ContactPack& pack, Substep& step, std::span<const Vec3f> rolling);
// Rolling friction and friction of a pack, by its normal impulses.
void solve_spins(ContactPack& pack, Substep& step, std::span<Vec3f> rolling);

// Of a contact with a shape: of the point's velocity relative to it, by the normal impulse N s.
struct ShapeFriction {
    Vec3d tangential = Vec3d::Zero();  // N s
    Vec3d rolling = Vec3d::Zero();     // N s: torque / r

    void start(Spin& spin, double w, const Vec3d& n) const;
    // turning: of the shape, rad/s. Returns the change of the velocity.
    Vec3d solve(Spin& spin, double w, const Vec3d& n, const Vec3d& velocity, const Vec3d& turning, double friction,
                double normal);
};

}  // namespace rapid

// Spin: points that turn, as solid spheres with the moment of inertia I = 2/5 m r² about their centers.
//
// The state is the speed of the surface, s = r ω, so that friction needs no radius. With n from the contact to the
// center, a contact at -r n moves by v + n × s, and an impulse q there changes
//
//   Δv = w q,   Δs = -k w n × q,   k = m r²/I = 5/2,   w = 1/m
//
// so that the sliding velocity u of a pair, and its change by an impulse q across n, are
//
//   u = v_i - v_j + n × (s_i + s_j),   Δu = (w_i + w_j + k_i w_i + k_j w_j) q
//
// Friction is Coulomb's on u. Rolling friction is a torque against the relative angular velocity, of at most μ_r N R
// with 1/R = 1/r_i + 1/r_j (Ai et al. 2011, model A), also solved as an impulse, so that it can bring a ball to rest.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/motion/ballistic_batch.h"

namespace rapid {

struct Substep;

struct Spin {
    Vec3d s = Vec3d::Zero();  // m/s: r ω
    double k = 0;             // 5/2; 0 for points that do not turn
    double radius = 0;        // m
    double rolling = 0;       // μ_r

    double kinetic_energy(double mass) const { return k > 0 ? 0.5 * mass / k * s.squaredNorm() : 0; }
    Vec3d angular_momentum(double mass) const { return k > 0 ? Vec3d(mass * radius / k * s) : Vec3d(Vec3d::Zero()); }
};

// Rotation of a set of points over a frame, read from the columns `w` (rad/s) and `orient`, and written back.
class SpinState {
public:
    static constexpr const char* names[] = {"orient", "w"};

    // Makes points with a radius turn, with this contact's properties. Throws Error if w is not finite.
    void include(const PointSet& points, const ContactMaterial& material);

    std::span<Spin> spins() { return spins_; }
    // begin() is called before a substep, turn() after it: turns the orientations by exp(ω dt), with the mean of ω.
    void begin() { before_ = spins_; }
    void turn(const OwnTime& time, int substeps);
    void store(PointSet& points) const;

private:
    std::vector<Spin> spins_, before_;
    std::vector<Eigen::Quaterniond> orient_;
};

// Returns the impulse of an impact on i, N s, and applies its friction to both spins. u: relative velocity of the
// centers at the time of impact; lever: their distance relative to the sum of the radii, at which friction acts.
Vec3d spinning_impact(Substep& step, std::uint32_t i, std::uint32_t j, const Vec3d& n, const Vec3d& u, double lever,
                      double restitution, double friction);
// The same for a point and a moving shape; w: 1/kg.
Vec3d spinning_impact(Spin& spin, double w, const Vec3d& n, const Vec3d& u, double restitution, double friction);

// Applies the warm start of a pack's friction to the spins; rolling: N m s on the first point, of all pairs.
void start_spins(const ContactPack& pack, Substep& step, std::span<const Vec3f> rolling);
// Solves rolling friction and friction of a pack from its normal impulses.
void solve_spins(ContactPack& pack, Substep& step, std::span<Vec3f> rolling);

// Friction of a contact with a shape, from the point's velocity relative to it and the normal impulse, N s.
struct ShapeFriction {
    Vec3d tangential = Vec3d::Zero();  // N s
    Vec3d rolling = Vec3d::Zero();     // N s: torque / r

    void start(Spin& spin, double w, const Vec3d& n) const;
    // turning: of the shape, rad/s. Returns the velocity change.
    Vec3d solve(Spin& spin, double w, const Vec3d& n, const Vec3d& velocity, const Vec3d& turning, double friction,
                double normal);
};

}  // namespace rapid

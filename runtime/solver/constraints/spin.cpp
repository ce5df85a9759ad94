#include "runtime/solver/constraints/spin.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/solver/constraints/impact.h"

namespace rapid {
namespace {

constexpr double solid_sphere = 2.5;  // m r²/I

// Rounding may leave an impulse, and thus the limit of friction, below 0.
Vec3d limited(const Vec3d& x, double most)
{
    if (!(most > 0)) return Vec3d::Zero();
    const double size = x.norm();
    return size > most ? Vec3d(most / size * x) : x;
}

// Returns the friction of an impact: at most the impulse that stops the sliding velocity u, with the effective mass.
Vec3d impact_friction(const Vec3d& u, double mass, double most) { return limited(-mass * u, most); }

Vec3d across(const Vec3d& x, const Vec3d& n) { return x - n.dot(x) * n; }

// Applies an impulse q at the contact to a spin; w: 1/kg.
void apply(Spin& spin, double w, double lever, const Vec3d& n, const Vec3d& q)
{
    spin.s -= lever * spin.k * w * n.cross(q);
}

// Applies a torque impulse, N m s, to a spin.
void twist(Spin& spin, double w, const Vec3d& torque)
{
    if (spin.k > 0) spin.s += spin.k * w / spin.radius * torque;
}

Vec3d angular_velocity(const Spin& spin) { return spin.k > 0 ? Vec3d(spin.s / spin.radius) : Vec3d(Vec3d::Zero()); }

// 1/I
double inverse_inertia(const Spin& spin, double w) { return spin.k > 0 ? spin.k * w / (spin.radius * spin.radius) : 0; }

struct Pair {
    Spin &a, &b;
    double wa, wb;  // 1/kg
    Vec3d n;
    double lever = 1;

    double turning() const { return lever * lever * (a.k * wa + b.k * wb); }
    Vec3d surface_velocity() const { return lever * n.cross(a.s + b.s); }
    void apply(const Vec3d& q)
    {
        rapid::apply(a, wa, lever, n, q);
        rapid::apply(b, wb, lever, n, q);
    }
    void twist(const Vec3d& torque)
    {
        rapid::twist(a, wa, torque);
        rapid::twist(b, wb, -torque);
    }
};

}  // namespace

void SpinState::include(const PointSet& points, const ContactMaterial& material)
{
    spins_.resize(points.size());
    orient_.resize(points.size(), Eigen::Quaterniond::Identity());
    const Strided<Vec3f> w = points.column<Vec3f>("w").read();
    const Strided<Quatf> orient = points.column<Quatf>("orient").read();
    for (std::size_t i = 0; i < spins_.size(); ++i) {
        const double radius = material.radius[i];
        if (!(radius > 0) || spins_[i].k > 0) continue;
        if (!w[i].allFinite()) throw Error(fmt::format("point {} has a w that is not finite", points.id()[i]));
        spins_[i] = {radius * w[i].cast<double>(), solid_sphere, radius, material.rolling[i]};
        orient_[i] = orient[i].cast<double>();
    }
}

void SpinState::turn(const OwnTime& time, int substeps)
{
    for (std::size_t i = 0; i < spins_.size(); ++i) {
        if (!(spins_[i].k > 0)) continue;
        const Vec3d turned = 0.5 * time(i) / substeps / spins_[i].radius * (before_[i].s + spins_[i].s);
        const double angle = turned.norm();
        if (!(angle > 0)) continue;
        orient_[i] = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turned / angle)) * orient_[i]).normalized();
    }
}

void SpinState::store(PointSet& points) const
{
    const std::span<Vec3f> w = points.column<Vec3f>("w").write();
    const std::span<Quatf> orient = points.column<Quatf>("orient").write();
    for (std::size_t i = 0; i < spins_.size(); ++i) {
        if (!(spins_[i].k > 0)) continue;
        w[i] = (spins_[i].s / spins_[i].radius).cast<float>();
        orient[i] = orient_[i].cast<float>();
    }
}

Vec3d spinning_impact(Substep& step, std::uint32_t i, std::uint32_t j, const Vec3d& n, const Vec3d& u, double lever,
                      double restitution, double friction)
{
    Pair pair{step.spins[i], step.spins[j], impact_inverse_mass(step, i), impact_inverse_mass(step, j), n, lever};
    const double W = pair.wa + pair.wb, normal = -(1 + restitution) * n.dot(u) / W;
    const Vec3d sliding = across(u, n) + pair.surface_velocity();
    const Vec3d q = impact_friction(sliding, 1 / (W + pair.turning()), friction * normal);
    pair.apply(q);
    return normal * n + q;
}

Vec3d spinning_impact(Spin& spin, double w, const Vec3d& n, const Vec3d& u, double restitution, double friction)
{
    const double normal = -(1 + restitution) * n.dot(u) / w;
    const Vec3d sliding = across(u, n) + n.cross(spin.s);
    const Vec3d q = impact_friction(sliding, 1 / (w * (1 + spin.k)), friction * normal);
    apply(spin, w, 1, n, q);
    return normal * n + q;
}

void start_spins(const ContactPack& pack, Substep& step, std::span<const Vec3f> rolling)
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        Pair pair{step.spins[i], step.spins[j], step.points[i].w, step.points[j].w, pack.n[l]};
        pair.apply(pack.tangential_impulse[l]);
        pair.twist(rolling[pack.pair[l]].cast<double>());
    }
}

void solve_spins(ContactPack& pack, Substep& step, std::span<Vec3f> rolling)
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        Pair pair{step.spins[i], step.spins[j], step.points[i].w, step.points[j].w, pack.n[l]};
        const double W = pair.wa + pair.wb, normal = pack.normal_impulse[l];
        if (!(W > 0)) continue;

        Vec3f& torque = rolling[pack.pair[l]];
        const double inertia = inverse_inertia(pair.a, pair.wa) + inverse_inertia(pair.b, pair.wb);
        if (inertia > 0 && (pair.a.rolling * pair.b.rolling > 0 || !torque.isZero(0))) {
            const double radius = 1 / (1 / pair.a.radius + 1 / pair.b.radius);
            const Vec3d holding =
                torque.cast<double>() - (angular_velocity(pair.a) - angular_velocity(pair.b)) / inertia;
            const double most = std::sqrt(pair.a.rolling * pair.b.rolling) * normal * radius;
            const Vec3f before = torque;
            torque = limited(holding, most).cast<float>();
            pair.twist((torque - before).cast<double>());
        }

        const Vec3d before = pack.tangential_impulse[l];
        const Vec3d sliding = across(step.v[i] - step.v[j], pair.n) + pair.surface_velocity();
        const Vec3d sticking = before - sliding / (W + pair.turning());
        pack.tangential_impulse.set(l, limited(sticking, pack.friction[l] * normal));
        const Vec3d change = Vec3d(pack.tangential_impulse[l]) - before;
        step.v[i] += pair.wa * change;
        step.v[j] -= pair.wb * change;
        step.points[i].P += 0.5 * step.dt * pair.wa * change;
        step.points[j].P -= 0.5 * step.dt * pair.wb * change;
        pair.apply(change);
    }
}

void ShapeFriction::start(Spin& spin, double w, const Vec3d& n) const
{
    apply(spin, w, 1, n, tangential);
    spin.s += spin.k * w * rolling;
}

Vec3d ShapeFriction::solve(Spin& spin, double w, const Vec3d& n, const Vec3d& velocity, const Vec3d& turning,
                           double friction, double normal)
{
    const Vec3d rolling_before = rolling, before = tangential;
    if (spin.k > 0) rolling = limited(rolling - (spin.s - spin.radius * turning) / (spin.k * w), spin.rolling * normal);
    spin.s += spin.k * w * (rolling - rolling_before);
    const Vec3d sliding = across(velocity, n) + n.cross(spin.s);
    tangential = limited(tangential - sliding / (w * (1 + spin.k)), friction * normal);
    apply(spin, w, 1, n, tangential - before);
    return w * (tangential - before);
}

}  // namespace rapid

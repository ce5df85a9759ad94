#include "runtime/solver/motion/surface_motion.h"

#include <algorithm>
#include <cmath>

#include "runtime/solver/motion/damped_motion.h"

namespace rapid {
namespace {

// Rotates x, perpendicular to the unit vector a, as a is rotated onto the unit vector b.
Vec3d turned(const Vec3d& x, const Vec3d& a, const Vec3d& b)
{
    const double both = 1 + a.dot(b);
    return both > 1e-9 ? Vec3d(x - b.dot(x) / both * (a + b)) : x;
}

Vec3d along_surface(const Vec3d& x, const Vec3d& n) { return x - x.dot(n) * n; }

// Returns ∫ X_G over the time t, by integrating X_G'' + k X_G' + w2 X_G = 1; near w2 = 0 it follows the cube of the
// time.
double integral_of_x_of_G(const Propagator& r, double k, double w2, double t)
{
    return w2 * t * t > 1e-4 ? (t - r.v_of_G - k * r.x_of_G) / w2 : t * r.x_of_G / 3;
}

}  // namespace

// Returns the end of the motion on a flat surface.
Vec3d SurfaceMotion::begin(double phi, const Vec3d& gradient, const Vec3d& V)
{
    const double slope = gradient.norm();
    acts_ = slope > 0;
    const Propagator along = respond(k, w2, t);
    if (!acts_) {
        P = P0 + v0 * along.x_of_v + G * along.x_of_G;
        v = v0 * along.v_of_v + G * along.v_of_G;
        return P;
    }
    n_ = n0_ = gradient / slope;
    d0_ = phi / slope;
    V0_ = V1_ = V;
    u0_ = v0 - V0_;
    pull_ = G - (k + 0.5 * t * w2) * V0_;
    const Propagator through = respond(k, w2 + s, t);
    const double displacement = u0_.dot(n0_) * through.x_of_v + (pull_.dot(n0_) - s * d0_) * through.x_of_G;
    return P0 + t * V0_ + along_surface(u0_, n0_) * along.x_of_v + along_surface(pull_, n0_) * along.x_of_G +
           displacement * n0_;
}

// Returns the end, except for the curvature of the surface. The middle normal is the mean of those at both ends.
Vec3d SurfaceMotion::advance(const Vec3d& gradient, const Vec3d& V)
{
    if (!acts_) return P;
    V1_ = V;
    pull_ = G - (V1_ - V0_) / t - (k + 0.5 * t * w2) * mean_V();
    Vec3d n1 = gradient.squaredNorm() > 0 ? Vec3d(gradient.normalized()) : n0_;
    if (turns_away(n1)) n1 = -n1;
    n_ = 1 + n0_.dot(n1) > 1e-9 ? Vec3d((n0_ + n1).normalized()) : n0_;
    const Propagator along = respond(k, w2, t), through = respond(k, w2 + s, t);
    const Vec3d from = turned(along_surface(u0_, n0_), n0_, n_), pull = along_surface(pull_, n_);
    const Vec3d turning = along_surface(n1 - n0_, n_) / t;  // n'
    const double speed = u0_.dot(n0_), integral = integral_of_x_of_G(through, k, w2 + s, t);
    const Vec3d straight = from * along.x_of_v + pull * along.x_of_G;
    Vec3d displacement = straight;
    double at_rest = 0;
    for (int iteration = 0; iteration < 2; ++iteration) {
        at_rest = pull_.dot(n_) + displacement.dot(turning) / t - s * d0_;
        displacement = straight - turning * (speed * through.x_of_G + at_rest * integral);
    }
    d1_ = d0_ + speed * through.x_of_v + at_rest * through.x_of_G;
    normal_v_ = speed * through.v_of_v + at_rest * through.v_of_G;
    tangential_ = from * along.v_of_v + pull * along.v_of_G - turning * ((d1_ - d0_) * std::exp(-0.5 * k * t));
    return at_ = P0 + t * mean_V() + displacement + (d1_ - d0_) * n_;
}

// Places the point at the distance d1, with the energy that it has there.
void SurfaceMotion::end(double phi, const Vec3d& gradient)
{
    if (!acts_) return;
    const double slope = turns_away(gradient) ? -gradient.norm() : gradient.norm();
    const Vec3d n1 = slope != 0 ? Vec3d(gradient / slope) : n_;
    const double d = slope != 0 ? phi / slope : d1_;
    P = at_ + (d1_ - d) * n1;
    double left = energy_left(P, d1_);
    if (left < 0) {  // the oscillator went beyond its energy: more than a radian in the step
        const std::optional<double> reached = distance_reached(at_ - d * n1, n1);
        if (!reached) {  // nor along the surface: it turns back
            d1_ = d0_;
            P = P0 + t * mean_V();
            v = V1_ - u0_;
            return;
        }
        d1_ = *reached;
        P = at_ + (d1_ - d) * n1;
        left = std::max(0.0, energy_left(P, d1_));
    }
    moved_ = d1_ - d;
    if (normal_v_ * normal_v_ > left) normal_v_ = std::copysign(std::sqrt(left), normal_v_);
    left = std::max(0.0, left - normal_v_ * normal_v_);
    const double size2 = tangential_.squaredNorm();
    const double target = k > 0 ? std::min(size2, left) : left;
    v = V1_ + normal_v_ * n1;
    if (size2 > 0) v += std::sqrt(target / size2) * turned(tangential_, n_, n1);
}

void SurfaceMotion::settle(double phi, const Vec3d& gradient)
{
    const double slope = gradient.norm(), d = slope > 0 ? phi / slope : phi;
    if (std::abs(d) >= std::abs(d1_)) return;
    const double had = (v - V1_).squaredNorm(),
                 freed = s * (std::abs(d1_) - std::abs(d)) * (std::abs(d1_) + std::abs(d));
    if (had > 0) v = V1_ + std::sqrt(1 + freed / had) * (v - V1_);
}

// Returns the distance nearest to d1, from `surface` along n, at which energy is left; the energy left is c + 2 b d -
// (s + w2) d².
std::optional<double> SurfaceMotion::distance_reached(const Vec3d& surface, const Vec3d& n) const
{
    const Vec3d displacement = surface - P0 - t * mean_V();
    const double a = s + w2, b = (pull_ - w2 * displacement).dot(n), c = energy_left(surface, 0);
    const double root2 = b * b + a * c;
    if (!(root2 >= 0)) return std::nullopt;
    const double root = std::sqrt(root2);
    return std::clamp(d1_, (b - root) / a, (b + root) / a);
}

Vec3d SurfaceMotion::path_v() const
{
    return acts_ ? Vec3d(V0_ + along_surface(u0_, n0_) + (d1_ - d0_) / t * n0_) : v0;
}

double SurfaceMotion::energy_left(const Vec3d& position, double distance) const
{
    const Vec3d displacement = position - P0 - t * mean_V();
    return u0_.squaredNorm() + s * (d0_ - distance) * (d0_ + distance) + 2 * pull_.dot(displacement) -
           w2 * displacement.squaredNorm();
}

}  // namespace rapid

#include "runtime/solver/surface_springs.h"

#include <algorithm>
#include <cmath>

#include "runtime/shapes/shape.h"
#include "runtime/solver/motion/damped_motion.h"

namespace rapid {

double potential_energy(const SurfaceSpring& spring, const Vec3d& P)
{
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    spring.shape->distance_at({&P, 1}, {&spring.time, 1}, {&phi, 1}, {&gradient, 1});
    const double slope2 = gradient.squaredNorm();
    if (slope2 > 0) return 0.5 * spring.w2 * phi * phi / slope2;
    return std::isinf(spring.shape->band()) ? 0.5 * spring.w2 * phi * phi : 0;
}

Vec3d velocity_of_surface(const SurfaceSpring& spring, const Vec3d& P, double before)
{
    return spring.shape->moves() ? spring.shape->velocity_at(P, spring.time - before) : Vec3d(Vec3d::Zero());
}

namespace {

Vec3d nearest(const Vec3d& P, double phi, const Vec3d& gradient)
{
    const double slope2 = gradient.squaredNorm();
    return slope2 > 0 ? Vec3d(P - phi / slope2 * gradient) : P;
}

}  // namespace

void SurfaceSprings::add(std::size_t i, const SurfaceSpring& spring, const Vec3d& P, double dt, Linear& linear)
{
    if (!(spring.w2 > 0)) return;
    if (indices_.empty()) springs_.assign(size_, {});
    SurfaceSpring& own = springs_[i];
    if (!own.shape)
        indices_.insert(std::upper_bound(indices_.begin(), indices_.end(), i), static_cast<std::uint32_t>(i));
    SurfaceSpring weaker = spring;
    if (spring.w2 > own.w2) std::swap(own, weaker);
    if (!weaker.shape) return;
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    weaker.shape->distance_at({&P, 1}, {&weaker.time, 1}, {&phi, 1}, {&gradient, 1});
    Vec3d position = nearest(P, phi, gradient);
    if (weaker.shape->moves()) position += 0.5 * dt * weaker.shape->velocity_at(position, weaker.time);
    linear.w2 += weaker.w2;
    linear.w2q += weaker.w2 * position;
}

void SurfaceSprings::advance(const PointBlock& block, std::span<const double> t)
{
    Responder responder;
    motions_.clear();
    at_.clear();
    times_.clear();
    for (const std::uint32_t i : indices_) {
        const Linear& linear = block.linear[i];
        SurfaceMotion motion;
        motion.P0 = motion.P = block.P[i];
        motion.v0 = motion.v = block.v[i];
        motion.t = t[i];
        motion.s = springs_[i].w2;
        motion.w2 = linear.w2;
        motion.G = acceleration_at_rest(block.P[i], block.a[i], linear);
        motion.k = respond(block.v[i], motion.G, linear, t[i], responder).rate;
        motion.two_sided = springs_[i].two_sided;
        motions_.push_back(motion);
        at_.push_back(motion.P0);
        times_.push_back(springs_[i].time);
        springs_[i].time += t[i];
    }
    query();
    for (std::size_t m = 0; m < motions_.size(); ++m) {
        const Vec3d V = shape_velocity(m);
        // In the middle of a ball, the distance grows in any direction.
        if (gradient_[m].isZero(0) && std::isinf(springs_[indices_[m]].shape->band()))
            gradient_[m] = (motions_[m].v0 - V).normalized();
        at_[m] = motions_[m].begin(phi_[m], gradient_[m], V);
    }
    for (std::size_t m = 0; m < motions_.size(); ++m) times_[m] = springs_[indices_[m]].time;
    query();
    for (std::size_t m = 0; m < motions_.size(); ++m)
        if (motions_[m].t > 0) at_[m] = motions_[m].advance(gradient_[m], shape_velocity(m));
    query();
    for (std::size_t m = 0; m < motions_.size(); ++m)
        if (motions_[m].t > 0) motions_[m].end(phi_[m], gradient_[m]);
    bool far = false;
    for (std::size_t m = 0; m < motions_.size(); ++m) {
        at_[m] = motions_[m].P;
        far |= motions_[m].t > 0 && motions_[m].far_from_query();
    }
    if (!far) return;
    query();
    for (std::size_t m = 0; m < motions_.size(); ++m)
        if (motions_[m].t > 0 && motions_[m].far_from_query()) motions_[m].settle(phi_[m], gradient_[m]);
}

// Returns the velocity of a motion's shape at the queried position, m/s.
Vec3d SurfaceSprings::shape_velocity(std::size_t m) const
{
    const Shape& shape = *springs_[indices_[m]].shape;
    return shape.moves() ? shape.velocity_at(at_[m], times_[m]) : Vec3d(Vec3d::Zero());
}

// Queries the distances and gradients of all points with springs, each for its own shape and time.
void SurfaceSprings::query()
{
    phi_.assign(at_.size(), 0);
    gradient_.assign(at_.size(), Vec3d::Zero());
    std::vector<std::uint8_t> done(at_.size());
    for (std::size_t first = 0; first < at_.size(); ++first) {
        if (done[first]) continue;
        const Shape* shape = springs_[indices_[first]].shape;
        queried_.clear();
        query_times_.clear();
        for (std::size_t m = first; m < at_.size(); ++m) {
            if (springs_[indices_[m]].shape != shape) continue;
            queried_.push_back(at_[m]);
            query_times_.push_back(times_[m]);
        }
        query_phi_.resize(queried_.size());
        query_gradient_.resize(queried_.size());
        shape->distance_at(queried_, query_times_, query_phi_, query_gradient_);
        for (std::size_t m = first, k = 0; m < at_.size(); ++m) {
            if (springs_[indices_[m]].shape != shape) continue;
            done[m] = 1;
            phi_[m] = query_phi_[k];
            gradient_[m] = query_gradient_[k++];
        }
    }
}

void SurfaceSprings::move(PointBlock& block) const
{
    for (std::size_t m = 0; m < motions_.size(); ++m) {
        block.P[indices_[m]] = motions_[m].P;
        block.v[indices_[m]] = motions_[m].v;
    }
}

// After a contact, the mean acceleration of the step is used.
void SurfaceSprings::bend(std::span<Damped> paths) const
{
    for (std::size_t m = 0; m < motions_.size(); ++m) {
        const SurfaceMotion& motion = motions_[m];
        const double t = motion.t;
        if (!(t > 0)) continue;
        Damped& path = paths[indices_[m]];
        const Propagator drag = respond(motion.k, 0, t);
        path.k = path.linear_k = motion.k;
        path.w2 = path.c = 0;
        path.G = (motion.v - motion.v0 * drag.v_of_v) / drag.v_of_G;
        path.travel = motion.P - motion.P0;
        path.v = motion.v;
        path.path_v = motion.path_v();
        path.path_a = (path.travel - t * path.path_v) * (2 / (t * t));
        path.pull.surface = springs_[indices_[m]];
        path.pull.surface.time -= t;
    }
}

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

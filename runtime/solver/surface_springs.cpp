#include "runtime/solver/surface_springs.h"

#include <algorithm>
#include <cmath>

#include "runtime/shapes/shape.h"

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

}  // namespace rapid

// Derives a shape's queries, and its first contact with many paths, from a sampler of its distance (docs/extending.md,
// A shape).
//
// ShapeOf<Derived> implements the queries of a shape with one member function, `sampler()`. It returns a small copyable
// struct that is created once per batch of points:
//
//   double distance(const Vec3d& P) const;                    m; beyond the band, a bound of the right sign
//   double distance(const Vec3d& P, Vec3d& gradient) const;   also the gradient, not normalised; zero if there is none
//   double slope_bound() const;                               the largest slope of the field
//   double smallest_feature() const;                          m: thinner walls may be missed; 0: convex
//   Box3d bounds() const;                                     the distance is above 0 outside it
//   double rounding() const;                                  m: error of a distance; default: single precision
//
// It may also offer faster versions for many points, distances() and distances_along() (see BakedSampler).
//
// Along a path x(s) the height is f(s) = distance(x(s)) - radius. A smallest feature of 0 means that the shape is
// convex. A bound without a shortest step then leads to the contact.
#pragma once

#include "runtime/shapes/sphere_tracing.h"

namespace rapid {

template <class Sampler>
concept samples_along = requires(const Sampler& sampler, const double* x, double* phi)
{
    sampler.distances_along(1, x, x, x, x, x, x, phi, phi);
};

// The starts of many paths, for a sampler that evaluates many points at once.
//
// Layout: structure of arrays; coordinates are shape [3, most].
struct PathBeginnings {
    static constexpr int most = 64;

    int size = 0;
    std::size_t path[most];
    double f[most], slope[most];  // height above the radius, m, and the slope of the field along the velocity, m/s
    bool is_flush[most];          // true also below the surface
    bool is_free[most];           // farther from the surface than the path can travel

    void add(std::size_t i, const Path& from)
    {
        const int k = size++;
        path[k] = i;
        for (int axis = 0; axis < 3; ++axis) {
            P_[axis][k] = from.P[axis];
            v_[axis][k] = from.v[axis];
            end_[axis][k] = from.v[axis] + from.duration * from.a[axis];
        }
        T_[k] = from.duration;
        radius_[k] = from.radius;
    }

    template <class Sampler>
    void sample(const Sampler& sampler)
    {
        const double rounding = rounding_of(sampler), steepest = sampler.slope_bound();
        sampler.distances_along(size, P_[0], P_[1], P_[2], v_[0], v_[1], v_[2], f, slope);
        for (int k = 0; k < size; ++k) {
            f[k] -= radius_[k];
            const double largest = std::max(std::max(std::abs(P_[0][k]), std::abs(P_[1][k])), std::abs(P_[2][k]));
            is_flush[k] = f[k] <= 0x1p-22 * (largest + radius_[k]) + rounding;
            // The speed is a convex function of time, so its maximum is at an end of the path.
            const auto square = [&](const double(&x)[3][most]) {
                return x[0][k] * x[0][k] + x[1][k] * x[1][k] + x[2][k] * x[2][k];
            };
            is_free[k] = f[k] >= T_[k] * steepest * std::sqrt(std::max(square(v_), square(end_)));
        }
    }

private:
    double P_[3][most], v_[3][most], end_[3][most], T_[most], radius_[most];
};

// Finds the first contact of each path.
template <class Sampler>
class FirstContactSearch {
public:
    FirstContactSearch(const Sampler& sampler, std::span<const Path> paths, std::span<Contact> contacts)
        : sampler_(sampler),
          paths_(paths),
          contacts_(contacts),
          rounding_(rounding_of(sampler)),
          tracing_(sampler, paths, contacts)
    {
    }

    void find()
    {
        const Box3d bounds = sampler_.bounds();
        for (std::size_t i = 0; i < paths_.size(); ++i) {
            contacts_[i] = Contact();
            if (!may_reach(paths_[i], bounds)) continue;
            if constexpr (samples_along<Sampler>) {
                some_.add(i, paths_[i]);
                if (some_.size == some_.most) begin_some();
            } else {
                begin(i);
            }
        }
        begin_some();
        tracing_.finish();
    }

private:
    static constexpr int max_steps_back = 4096;

    void begin_some()
    {
        if constexpr (samples_along<Sampler>) some_.sample(sampler_);
        for (int k = 0; k < some_.size; ++k) {
            const std::size_t i = some_.path[k];
            if (some_.is_flush[k])
                begin(i);
            else if (!some_.is_free[k])
                tracing_.begin(i, 0, some_.f[k], some_.slope[k], paths_[i].radius);
        }
        some_.size = 0;
    }

    void begin(std::size_t i)
    {
        const Path& path = paths_[i];
        typename StaticField<Sampler>::Sample start;
        const double phi = sampler_.distance(path.P, start.gradient), f = phi - path.radius;
        const double flush = flush_within(path.P, path.radius, rounding_);
        if (f < -flush) {
            contacts_[i] = inside(path, f, start.gradient);
            return;
        }
        // A point slightly below the surface by rounding uses its own height as the level to touch at.
        const double level = path.radius + std::min(f, 0.0);
        const bool convex = !(sampler_.smallest_feature() > 0);
        start.X = path.P;
        start.velocity = path.v;
        start.height = convex ? phi - level : f + path.radius - level;
        start.slope = start.gradient.dot(path.v);
        ContactWalk walk(StaticField<Sampler>{sampler_, path, level}, start, 0, path.duration);
        if (f <= flush) walk.leave_surface(2 * flush);
        if (convex || walk.is_over())
            contacts_[i] = walk.walk();
        else
            tracing_.begin(i, walk.time(), walk.here().height, start.slope, level);
    }

    // Returns the contact of a path that starts inside. If the field has no gradient there, the point moves towards the
    // nearest voxel at the surface of a level set. In another field it moves straight back, against its velocity (paper
    // §4.1), until the field has a gradient or it is outside.
    Contact inside(const Path& path, double f, const Vec3d& gradient) const
    {
        Contact contact;
        contact.time = 0;
        contact.depth = -f;
        const double slope = gradient.norm();
        if (slope > 0) {
            contact.n = gradient / slope;
            if constexpr (requires { sampler_.band(); })
                if (is_at_band_edge(f + path.radius, sampler_.band(), sampler_.smallest_feature())) return contact;
            contact.depth /= slope;  // to first order; exact if the field is a distance
            return contact;
        }
        if constexpr (requires { sampler_.nearest_inside(path.P); })
            if (const std::optional<Vec3d> nearest = sampler_.nearest_inside(path.P)) {
                const Vec3d displacement = *nearest - path.P;
                contact.depth = displacement.norm();
                contact.n = displacement / contact.depth;
                return contact;
            }
        const double speed = path.v.norm();
        if (!(speed > 0)) return contact;
        const Box3d bounds = sampler_.bounds();
        // Each step is as long as the bound on the distance allows, so at least the half width of the band. A
        // user-supplied field may be negative everywhere, and then there is no way out.
        double back = 0;
        for (int steps = 0; steps < max_steps_back; ++steps) {
            back += std::abs(f) / (sampler_.slope_bound() * speed);
            const Vec3d P = path.P - back * path.v;
            Vec3d there;
            f = sampler_.distance(P, there) - path.radius;
            if (f >= 0 || there.squaredNorm() > 0 || !bounds.contains(P)) {
                contact.back = back;
                return contact;
            }
        }
        return contact;
    }

    const Sampler& sampler_;
    std::span<const Path> paths_;
    std::span<Contact> contacts_;
    double rounding_;
    SphereTracing<Sampler> tracing_;
    PathBeginnings some_;
};

// Base: Shape, or a class derived from it with more virtual functions.
template <class Derived, class Base = Shape>
class ShapeOf : public Base {
public:
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        const auto sampler = derived().sampler();
        if (gradient.empty())
            for (std::size_t i = 0; i < P.size(); ++i) phi[i] = sampler.distance(P[i]);
        else
            for (std::size_t i = 0; i < P.size(); ++i) phi[i] = sampler.distance(P[i], gradient[i]);
    }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        const auto sampler = derived().sampler();
        FirstContactSearch(sampler, paths, contacts).find();
    }

    double smallest_feature() const override { return derived().sampler().smallest_feature(); }

private:
    const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

}  // namespace rapid

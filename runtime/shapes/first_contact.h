// The first contact of a path with a shape that can only be asked for its distance: the walk that never goes through a
// wall (numerics.md, Collision).
//
// ShapeOf<Derived> gives a shape its queries from one member function, `sampler()`, which returns a small copyable
// struct, made once for a batch of points:
//
//   double distance(const Vec3d& P) const;                   m; beyond the band a bound of the right sign
//   double distance(const Vec3d& P, Vec3d& gradient) const;  and the gradient, not normalised, zero where there is none
//   double slope_bound() const;                              the largest slope of the field
//   double smallest_feature() const;                         m: a wall thinner than this may be missed; 0: none is
//   double band() const;                                     m: the largest |distance| that is exact
//   Box3d bounds() const;                                    outside it the distance is above 0
//   double rounding() const;                                 m: error of a distance; where missing, of single precision
//
// The field is asked along x(s) = P + v s + a s²/2, with f(s) = distance(x(s)) - radius. A smallest feature of 0 says
// that the shape is convex: then another bound, that needs no smallest step, leads to the contact.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/shapes/shape.h"

namespace rapid {

// How near to the surface a point is flush with it, m: what rounding its position to single precision can do (ulp(x) is
// at most 2^-23 |x|, and half of it an axis), and the field's own error. A point that a frame leaves on the surface
// must be found on it by the next one: with less than this, resting points would now and then be taken for sunken ones.
inline double flush_within(const Vec3d& P, double radius, double rounding)
{
    return 0x1p-22 * (P.cwiseAbs().maxCoeff() + radius) + rounding;
}

// Whether a velocity has no more of a component along a unit normal than rounding gives one that is tangential. Without
// this a point that slides could meet its own floor again and again, and get nowhere.
inline bool is_along(double vn, const Vec3d& v) { return vn < 0 && vn * vn < 0x1p-96 * v.squaredNorm(); }

// Whether a path can come near a box, by the box around the path.
inline bool may_reach(const Path& path, const Box3d& bounds)
{
    const double half = path.duration * path.duration / 2;
    for (int k = 0; k < 3; ++k) {
        const double travel = path.v[k] * path.duration, fall = path.a[k] * half;
        const double lowest = path.P[k] + std::min(0.0, travel) + std::min(0.0, fall);
        const double highest = path.P[k] + std::max(0.0, travel) + std::max(0.0, fall);
        // The factor keeps a point that is flush with the box and rounded away from it.
        const double margin = path.radius + 0x1p-21 * (std::abs(path.P[k]) + path.radius);
        if (highest < bounds.min()[k] - margin || lowest > bounds.max()[k] + margin) return false;
    }
    return true;
}

namespace detail {

template <class Sampler>
double rounding_of(const Sampler& sampler)
{
    if constexpr (requires { sampler.rounding(); })
        return sampler.rounding();
    else
        return 0x1p-21 * sampler.smallest_feature();
}

inline Vec3d place(const Path& path, double s) { return path.P + s * (path.v + 0.5 * s * path.a); }

// The time in which a point of this speed and acceleration can travel a distance: the root of
// distance = speed s + acceleration s²/2, without cancellation. Infinite for a point that stays.
inline double time_to_travel(double distance, double speed, double acceleration)
{
    const double sum = speed + std::sqrt(speed * speed + 2 * acceleration * distance);
    return sum > 0 ? 2 * distance / sum : Contact::none;
}

inline Vec3d unit_normal(const Vec3d& gradient, const Vec3d& v)
{
    const double size = gradient.norm();
    if (size > 0) return gradient / size;
    const double speed = v.norm();
    return speed > 0 ? Vec3d(-v / speed) : Vec3d(Vec3d::UnitY());
}

// A path that starts inside. Where the field has no gradient (beyond a level set's band), the point goes back the way
// that it came (paper §4.1), to where the field has one, or to the outside.
template <class Sampler>
Contact start_inside(const Sampler& sampler, const Path& path, double f, const Vec3d& gradient)
{
    Contact contact;
    contact.time = 0;
    contact.depth = -f;
    const double slope = gradient.norm();
    if (slope > 0) {
        contact.n = gradient / slope;
        contact.depth /= slope;  // to first order; exact where the field is a distance
        return contact;
    }
    const double speed = path.v.norm();
    if (!(speed > 0)) return contact;
    const Box3d bounds = sampler.bounds();
    // Each step is as long as the bound on the distance allows, so at least the half width of the band.
    for (double back = 0;;) {
        back += std::abs(f) / (sampler.slope_bound() * speed);
        const Vec3d P = path.P - back * path.v;
        Vec3d there;
        f = sampler.distance(P, there) - path.radius;
        if (f >= 0 || there.squaredNorm() > 0 || !bounds.contains(P)) {
            contact.back = back;
            return contact;
        }
    }
}

// The last time at which the path is outside, of a step at whose beginning it is (f >= 0) and at whose end it is not:
// regula falsi with Illinois' halving, down to the rounding of the field, or of the time.
template <class Sampler>
double refine(const Sampler& sampler, const Path& path, double level, double before, double f_before, double after,
              double f_after, double close)
{
    const double speed = path.v.norm() + after * path.a.norm();  // the largest on the way
    double ahead = f_before;   // as sampled: f_before and f_after are halved on the way
    int kept = 0;              // how often in a row the same end was kept: +1, +2, ... before, -1, -2, ... after
    constexpr int most = 200;  // far above what bisection alone needs for 53 bits
    for (int i = 0; i < most && ahead > close; ++i) {
        if (after - before <= 0x1p-52 * after || speed * (after - before) <= close) break;
        // Every fourth step is bisection: a field with a kink can hold regula falsi up, and nothing holds that up.
        double s = i % 4 == 3 ? 0.5 * (before + after) : before + (after - before) * f_before / (f_before - f_after);
        if (!(s > before && s < after)) s = 0.5 * (before + after);
        if (!(s > before && s < after)) break;
        const double f = sampler.distance(place(path, s)) - level;
        if (f >= 0) {
            before = s, f_before = ahead = f;
            kept = kept < 0 ? kept - 1 : -1;
            if (kept < -1) f_after *= 0.5;
        } else {
            after = s, f_after = f;
            kept = kept > 0 ? kept + 1 : 1;
            if (kept > 1) f_before *= 0.5;
        }
    }
    return before;
}

// How the normal turns towards the velocity, a short way ahead along the surface.
template <class Sampler>
double curvature(const Sampler& sampler, const Vec3d& P, const Vec3d& n, const Vec3d& v)
{
    const Vec3d tangent = v - n.dot(v) * n;
    const double speed = tangent.norm(), feature = sampler.smallest_feature();
    if (!(speed > 0)) return 0;
    const double way = feature > 0 ? feature / 2 : 0x1p-20 * sampler.bounds().sizes().maxCoeff();
    Vec3d ahead;
    sampler.distance(P + way / speed * tangent, ahead);
    const double size = ahead.norm();
    return size > 0 ? tangent.dot(ahead / size - n) / (speed * way) : 0;
}

template <class Sampler>
Contact contact_at(const Sampler& sampler, const Path& path, double s)
{
    Contact contact;
    contact.time = s;
    Vec3d gradient;
    const Vec3d P = place(path, s), v = path.v + s * path.a;
    sampler.distance(P, gradient);
    contact.n = unit_normal(gradient, v);
    contact.curvature = curvature(sampler, P, contact.n, v);
    return contact;
}

// The walk s += D / (|v| + ...), D = f / L: as far as the point can travel without reaching the surface. At least a
// quarter of the smallest feature, so that it comes to an end, by a change of sign that is then refined; no wall of two
// features is stepped over.
template <class Sampler>
Contact walk(const Sampler& sampler, const Path& path, double s, double f, double level, double close)
{
    const double least = sampler.smallest_feature() / 4, per_slope = 1 / sampler.slope_bound();
    const double acceleration = path.a.norm();
    while (s < path.duration) {
        const double speed = (path.v + s * path.a).norm();
        const double step = time_to_travel(std::max(f * per_slope, least), speed, acceleration);
        const double next = std::min(path.duration, s + step);
        if (!(next > s)) break;  // a step below the rounding of the time: as good as there
        const double f_next = sampler.distance(place(path, next)) - level;
        if (f_next < 0) return contact_at(sampler, path, refine(sampler, path, level, s, f, next, f_next, close));
        s = next, f = f_next;
    }
    return {};
}

// For a convex shape the distance is a convex function, so along the path f'' >= n·a >= -|a|, and
//
//   f(s + τ) >= f + f' τ - |a| τ²/2.
//
// The walk to the root of the right side never passes the surface and, unlike that of a mere bound on the slope, closes
// in on it quadratically, as Newton's method does.
template <class Sampler>
Contact approach(const Sampler& sampler, const Path& path, double s, double level, double close)
{
    const double acceleration = path.a.norm();
    Vec3d gradient;
    double f = sampler.distance(place(path, s), gradient) - level;
    constexpr int most = 500;  // a graze halves the distance each time, down from any size: below 200
    for (int i = 0; i < most; ++i) {
        if (f <= close) {
            // The graze of a point that is leaving is no contact.
            const Vec3d v = path.v + s * path.a;
            const double vn = gradient.dot(v);
            if (vn < 0 && !is_along(vn, v)) return contact_at(sampler, path, s);
            f = close;
        }
        const double approaching = -gradient.dot(path.v + s * path.a);
        if (acceleration == 0 && approaching <= 0) return {};
        const double root = std::sqrt(approaching * approaching + 2 * acceleration * f);
        const double step = approaching > 0 ? 2 * f / (approaching + root) : (root - approaching) / acceleration;
        if (!(s + step < path.duration)) return {};
        if (!(s + step > s)) return contact_at(sampler, path, s);
        s += step;
        f = sampler.distance(place(path, s), gradient) - level;
    }
    return contact_at(sampler, path, s);
}

}  // namespace detail

// The first contact of one path (see Contact).
template <class Sampler>
Contact first_contact_on(const Sampler& sampler, const Path& path)
{
    Vec3d gradient;
    const double f = sampler.distance(path.P, gradient) - path.radius;
    const double rounding = detail::rounding_of(sampler);
    const double flush = flush_within(path.P, path.radius, rounding);
    if (f < -flush) return detail::start_inside(sampler, path, f, gradient);

    const double close = std::max(0x1p-50 * (path.P.cwiseAbs().maxCoeff() + path.radius), rounding / 16);
    // A point that rounding left a little below the surface goes by the level that it is on.
    const double level = path.radius + std::min(f, 0.0);
    double s = 0, ahead = f + path.radius - level;
    if (f <= flush) {
        const double vn = gradient.dot(path.v);
        if (vn < 0 && !is_along(vn, path.v)) return detail::contact_at(sampler, path, 0);
        // Pressed inwards, though it may still move outwards by less than will lift it by more than rounding: the test
        // is where it is after the time of such a hop.
        const double acceleration = path.a.norm();
        if (acceleration > 0) {
            double hop = 2 * std::sqrt(2 * flush / acceleration);
            const double speed = path.v.norm(), feature = sampler.smallest_feature();
            if (feature > 0 && hop * speed > feature / 4) hop = feature / (4 * speed);
            hop = std::min(hop, path.duration);
            const double after = sampler.distance(detail::place(path, hop)) - level;
            if (after < 0) return detail::contact_at(sampler, path, 0);
            s = hop, ahead = after;
        }
    }
    if (sampler.smallest_feature() > 0) return detail::walk(sampler, path, s, ahead, level, close);
    return detail::approach(sampler, path, s, level, close);
}

// A shape's queries, from its sampler. Base: Shape, or a kind of it that asks for more.
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
        const Box3d bounds = sampler.bounds();
        for (std::size_t i = 0; i < paths.size(); ++i)
            contacts[i] = may_reach(paths[i], bounds) ? first_contact_on(sampler, paths[i]) : Contact();
    }

    double smallest_feature() const override { return derived().sampler().smallest_feature(); }

private:
    const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

}  // namespace rapid

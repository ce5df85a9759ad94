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

#include "runtime/shapes/last_outside.h"
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

// The first s >= 0 at which f + vn s + an s²/2 goes from above 0 to below, for f >= 0; infinite where it does not. Of
// the two forms of the root the one without cancellation.
inline double first_fall_through(double f, double vn, double an)
{
    const double discriminant = vn * vn - 2 * an * f;
    if (an >= 0) {
        if (vn >= 0 || discriminant < 0) return Contact::none;
        return 2 * f / (std::sqrt(discriminant) - vn);
    }
    const double root = std::sqrt(discriminant);
    return vn > 0 ? (vn + root) / -an : 2 * f / (root - vn);
}

inline Vec3d place(const Path& path, double s) { return path.P + s * (path.v + 0.5 * s * path.a); }

// Whether a path can come near a box, by the box around the path. `end` is where it ends; on the way it is off the
// straight line between by a T²/8 at most.
inline bool may_reach(const Vec3d& P, const Vec3d& end, const Vec3d& a, double duration, double radius,
                      const Box3d& bounds)
{
    const double sagging = duration * duration / 8;
    bool may = true;
    for (int k = 0; k < 3; ++k) {
        // The factor keeps a point that is flush with the box and rounded away from it.
        const double margin = sagging * std::abs(a[k]) + radius + 0x1p-21 * (std::abs(P[k]) + radius);
        may &= std::max(P[k], end[k]) >= bounds.min()[k] - margin;
        may &= std::min(P[k], end[k]) <= bounds.max()[k] + margin;
    }
    return may;
}
inline bool may_reach(const Path& path, const Box3d& bounds)
{
    return may_reach(path.P, place(path, path.duration), path.a, path.duration, path.radius, bounds);
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

// ahead: s, a time soon after, of a field with kinks; 0 of one without.
template <class Sampler>
Contact contact_at(const Sampler& sampler, const Path& path, double s, double ahead = 0)
{
    Contact contact;
    contact.time = s;
    Vec3d gradient;
    const Vec3d P = place(path, s), v = path.v + s * path.a;
    sampler.distance(P, gradient);
    if (ahead > s && gradient.dot(v) >= 0) {
        // On a kink of the field, and still on its side that the path leaves by: the surface that it meets is ahead.
        Vec3d there;
        sampler.distance(place(path, ahead), there);
        if (there.dot(v) < 0) gradient = there;
    }
    contact.n = unit_normal(gradient, v);
    contact.curvature = curvature(sampler, P, contact.n, v);
    return contact;
}

// Distances along many paths: by the sampler's own loop where it has one.
template <class Sampler>
void distances(const Sampler& sampler, int n, const double* X, const double* Y, const double* Z, double* phi)
{
    if constexpr (requires { sampler.distances(n, X, Y, Z, phi); })
        sampler.distances(n, X, Y, Z, phi);
    else
        for (int k = 0; k < n; ++k) phi[k] = sampler.distance({X[k], Y[k], Z[k]});
}

// Walks by sphere tracing along many paths at once, a step of each in turn: their samples are independent, and the
// loops over them have no branches.
//
// From a place at f >= 0 from the surface all of the way within D = f / L is free, behind as well as ahead. So the next
// place to ask is ahead of D by as much as its own D will reach back to, going by the slope of the field along the way
// so far (auto-relaxed sphere tracing, Bán and Valasek 2023); where it does not reach, the gap's near end is asked.
// Steps are at least a quarter of the smallest feature, so that a walk comes to an end, by a change of sign that is
// then refined; no wall of two features is stepped over.
template <class Sampler>
class Walks {
public:
    Walks(const Sampler& sampler, std::span<const Path> paths, std::span<Contact> contacts)
        : sampler_(sampler), paths_(paths), contacts_(contacts)
    {
    }

    // Along path i, from time s on, where the field is f above `level`. slope: of f there, m/s.
    void begin(std::size_t i, double s, double f, double slope, double level, double close)
    {
        const Path& path = paths_[i];
        const double T = path.duration;
        if (!reach_speed(i, s, f, slope, level, close)) return;
        // The speed is convex along the way.
        const double fastest =
            std::sqrt(std::max((path.v + s * path.a).squaredNorm(), (path.v + T * path.a).squaredNorm()));
        const double per_f = 1 / (sampler_.slope_bound() * fastest);
        if (!(fastest > 0) || s + f * per_f >= T) return;
        const int k = n_++;
        for (int axis = 0; axis < 3; ++axis) {
            P_[axis][k] = path.P[axis];
            v_[axis][k] = path.v[axis];
            a_[axis][k] = path.a[axis];
        }
        T_[k] = T;
        s_[k] = s;
        f_[k] = f;
        per_f_[k] = per_f;
        least_[k] = 0.25 * sampler_.smallest_feature() / fastest;
        slope_[k] = std::min(slope * per_f, flattest);
        level_[k] = level;
        close_[k] = close;
        path_[k] = i;
        if (n_ == most) finish();
    }

    // Walks all to their ends, and writes the contacts of those that have one.
    void finish()
    {
        while (n_ > 0) step();
    }

private:
    // A walk goes by the largest speed of the way that is left, and would take for ever where a path is at rest at
    // first and a world away in the end. Until it is not much slower than there, each step is as long as its speed and
    // acceleration take it. False: it has come to its end, with a contact or without one.
    bool reach_speed(std::size_t i, double& s, double& f, double& slope, double level, double close)
    {
        const Path& path = paths_[i];
        const double feature = sampler_.smallest_feature(), a = path.a.norm(), T = path.duration;
        if (!(feature > 0) || !(0.5 * a * T * T > a_world * feature)) return true;
        const double end = (path.v + T * path.a).norm();
        Vec3d v = path.v + s * path.a;
        while (end > much_faster * v.norm() && s < T) {
            const double reach = std::max(f / sampler_.slope_bound(), 0.25 * feature);
            const double next = std::min(T, s + time_to_travel(reach, v.norm(), a));
            if (!(next > s)) break;
            Vec3d gradient;
            const double there = sampler_.distance(place(path, next), gradient) - level;
            if (there < 0) {
                const auto height = [&](double t) { return sampler_.distance(place(path, t)) - level; };
                const double speed = path.v.norm() + next * a;
                contacts_[i] = contact_at(sampler_, path, last_outside(height, s, f, next, there, speed, close));
                return false;
            }
            s = next;
            f = there;
            v = path.v + s * path.a;
            slope = gradient.dot(v);
        }
        return s < T;
    }

    static constexpr int most = 64;
    static constexpr double much_faster = 64, a_world = 1e6;  // features
    // Of what the slope promises; the largest slope away from the surface, and the longest step in D, to count on it.
    static constexpr double cautious = 0.9, flattest = 0.9, farthest = 4;

    void step()
    {
        double near[most], next[most], f[most];
        for (int k = 0; k < n_; ++k) {
            const double reach = f_[k] * per_f_[k], ahead = 2 * cautious / (1 - slope_[k]);
            near[k] = s_[k] + std::max(reach, least_[k]);
            const double far = s_[k] + reach * std::min(std::max(ahead, 1.0), farthest);
            next[k] = std::min(std::max(near[k], far), T_[k]);
        }
        sample(next, f);
        int gaps[most], gap_count = 0;
        for (int k = 0; k < n_; ++k) {
            gaps[gap_count] = k;
            gap_count += (next[k] > near[k]) & ((f_[k] + f[k]) * per_f_[k] < next[k] - s_[k]);
        }
        for (int j = 0; j < gap_count; ++j) {
            const int k = gaps[j];
            next[k] = near[k];
            f[k] = sampler_.distance(place(paths_[path_[k]], next[k])) - level_[k];
        }

        bool over[most];
        for (int k = 0; k < n_; ++k) {
            const double before = s_[k], slope = (f[k] - f_[k]) * per_f_[k] / (next[k] - before);
            // The last: a step below the rounding of the time is as good as there.
            over[k] = (f[k] < 0) | (next[k] + f[k] * per_f_[k] >= T_[k]) | !(next[k] > before);
            slope_[k] = std::min(slope, flattest);
        }
        int still = 0;
        for (int k = 0; k < n_; ++k) {
            if (over[k]) {
                if (f[k] < 0 && next[k] > s_[k]) meet(k, next[k], f[k]);
                continue;
            }
            s_[k] = next[k];
            f_[k] = f[k];
            if (still != k) move(k, still);
            ++still;
        }
        n_ = still;
    }

    void sample(const double* s, double* f)
    {
        double x[3][most];
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < n_; ++k) x[axis][k] = P_[axis][k] + s[k] * (v_[axis][k] + 0.5 * s[k] * a_[axis][k]);
        distances(sampler_, n_, x[0], x[1], x[2], f);
        for (int k = 0; k < n_; ++k) f[k] -= level_[k];
    }

    void meet(int k, double next, double f)
    {
        const Path& path = paths_[path_[k]];
        const double speed = path.v.norm() + next * path.a.norm();  // the largest on the way
        const auto height = [&](double s) { return sampler_.distance(place(path, s)) - level_[k]; };
        const double s = last_outside(height, s_[k], f_[k], next, f, speed, close_[k]);
        contacts_[path_[k]] = contact_at(sampler_, path, s, s + 0x1p-8 * least_[k]);
    }

    void move(int from, int to)
    {
        for (int axis = 0; axis < 3; ++axis)
            for (auto* x : {P_[axis], v_[axis], a_[axis]}) x[to] = x[from];
        for (double* x : {T_, s_, f_, per_f_, least_, slope_, level_, close_}) x[to] = x[from];
        path_[to] = path_[from];
    }

    const Sampler& sampler_;
    std::span<const Path> paths_;
    std::span<Contact> contacts_;

    int n_ = 0;
    std::size_t path_[most];
    double P_[3][most], v_[3][most], a_[3][most], T_[most];
    double s_[most], f_[most];  // where it is, s, and how far from the surface
    double per_f_[most];        // s that are free, for each m of distance
    double least_[most];        // s, the shortest step
    double slope_[most];        // of the field along the way, as a part of the steepest there can be: -1 to 1
    double level_[most], close_[most];
};

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

// Many paths where they begin, for a sampler that asks along many at once.
//
// Layout: structure of arrays; coordinates are shape [3, most].
struct Beginnings {
    static constexpr int most = 64;

    int size = 0;
    std::size_t path[most];
    double f[most], slope[most];  // m above the surface, and how the field changes along the velocity, m/s
    bool is_flush[most];          // or below the surface
    bool is_free[most];           // it is farther from the surface than its way is long

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
    void ask(const Sampler& sampler)
    {
        const double rounding = rounding_of(sampler), steepest = sampler.slope_bound();
        sampler.distances_along(size, P_[0], P_[1], P_[2], v_[0], v_[1], v_[2], f, slope);
        for (int k = 0; k < size; ++k) {
            f[k] -= radius_[k];
            const double largest = std::max(std::max(std::abs(P_[0][k]), std::abs(P_[1][k])), std::abs(P_[2][k]));
            is_flush[k] = f[k] <= 0x1p-22 * (largest + radius_[k]) + rounding;
            // The speed is convex along the way.
            const auto square = [&](const double(&x)[3][most]) {
                return x[0][k] * x[0][k] + x[1][k] * x[1][k] + x[2][k] * x[2][k];
            };
            is_free[k] = f[k] >= T_[k] * steepest * std::sqrt(std::max(square(v_), square(end_)));
        }
    }

private:
    double P_[3][most], v_[3][most], end_[3][most], T_[most], radius_[most];
};

}  // namespace detail

template <class Sampler>
concept asks_along = requires(const Sampler& sampler, const double* x, double* phi)
{
    sampler.distances_along(1, x, x, x, x, x, x, phi, phi);
};

// The first contact of each path.
template <class Sampler>
void first_contacts(const Sampler& sampler, std::span<const Path> paths, std::span<Contact> contacts)
{
    const Box3d bounds = sampler.bounds();
    const double rounding = detail::rounding_of(sampler), feature = sampler.smallest_feature();
    detail::Walks walks(sampler, paths, contacts);
    const auto close_to = [&](const Path& path) {
        return std::max(0x1p-50 * (path.P.cwiseAbs().maxCoeff() + path.radius), rounding / 16);
    };
    const auto begin = [&](std::size_t i) {
        const Path& path = paths[i];
        Vec3d gradient;
        const double f = sampler.distance(path.P, gradient) - path.radius;
        const double flush = flush_within(path.P, path.radius, rounding);
        if (f < -flush) {
            contacts[i] = detail::start_inside(sampler, path, f, gradient);
            return;
        }
        const double close = close_to(path);
        // A point that rounding left a little below the surface goes by the level that it is on.
        const double level = path.radius + std::min(f, 0.0);
        double s = 0, ahead = f + path.radius - level;
        const double slope = gradient.dot(path.v);
        if (f <= flush) {
            if (slope < 0 && !is_along(slope, path.v)) {
                contacts[i] = detail::contact_at(sampler, path, 0);
                return;
            }
            // It leaves, or is pressed inwards though it may still move outwards by less than will lift it by more than
            // rounding: the test is where it is after the time of such a hop. From there it is a path as any other,
            // which may come back within a voxel.
            const double acceleration = path.a.norm(), speed = path.v.norm();
            double hop = Contact::none;
            if (acceleration > 0) hop = 2 * std::sqrt(2 * flush / acceleration);
            if (feature > 0 && slope > 0) hop = std::min(hop, 2 * flush / slope);
            if (hop < Contact::none) {
                if (feature > 0 && hop * speed > feature / 4) hop = feature / (4 * speed);
                hop = std::min(hop, path.duration);
                const double after = sampler.distance(place(path, hop)) - level;
                if (after < 0) {
                    contacts[i] = detail::contact_at(sampler, path, 0, hop);
                    return;
                }
                s = hop, ahead = after;
            }
        }
        if (feature > 0)
            walks.begin(i, s, ahead, slope, level, close);
        else
            contacts[i] = detail::approach(sampler, path, s, level, close);
    };

    detail::Beginnings some;
    const auto begin_some = [&] {
        if constexpr (asks_along<Sampler>) some.ask(sampler);
        for (int k = 0; k < some.size; ++k) {
            const std::size_t i = some.path[k];
            if (some.is_flush[k])
                begin(i);
            else if (!some.is_free[k])
                walks.begin(i, 0, some.f[k], some.slope[k], paths[i].radius, close_to(paths[i]));
        }
        some.size = 0;
    };
    for (std::size_t i = 0; i < paths.size(); ++i) {
        contacts[i] = Contact();
        if (!may_reach(paths[i], bounds)) continue;
        if constexpr (asks_along<Sampler>) {
            some.add(i, paths[i]);
            if (some.size == some.most) begin_some();
        } else {
            begin(i);
        }
    }
    begin_some();
    walks.finish();
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
        first_contacts(derived().sampler(), paths, contacts);
    }

    double smallest_feature() const override { return derived().sampler().smallest_feature(); }

private:
    const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

}  // namespace rapid

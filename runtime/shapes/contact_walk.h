// The walk along a path to its first contact, by conservative advancement: a bound on the field shows that each step is
// free of the surface (docs/numerics.md, Collision). Static, rigid and deforming fields share it.
//
// Field is a distance field as seen from one path:
//
//   Sample at(double s, Hint, Exact) const;     the field at time s of the path
//   double height(double s, Hint) const;        only Sample::height
//   Vec3d gradient_at(const Vec3d& X, double s, const Sample& here) const;   near a sample, in the field's frame
//   Contact contact(double s, const Vec3d& n, const Sample& here) const;     time, normal and velocity, in world space
//
//   double step(double s, const Sample& here) const;    s to advance: free of the surface, or short of any feature
//   double hop(const Sample& here) const;               s, the shortest step where rounding may dip below the surface
//   double fastest(double s, const Sample& here, double after) const;    bound on the relative speed from s to after
//   double approach_speed(const Sample& ahead, const Sample& here) const;    slope at a sample shortly after another
//   double acceleration() const;                        bound on the relative acceleration
//   double close(const Sample&) const;                  the height that counts as touching
//   double smallest_feature() const;                    0: the field is convex
//   Box3d bounds() const;
//   bool open_ended() const;                            true: a contact at the very end of the path is ignored
//   static constexpr double kink;                       fraction of a step, for contact_at()
//
// Lengths are in metres, or in rest units if the shape is scaled. Sample has
//
//   double height;   above the level that the path touches at; >= 0 outside
//   double slope;    its derivative by s
//   Vec3d X;         position in the field's frame
//   Vec3d gradient;  not normalised; zero if the field has none
//   Vec3d velocity;  of the path relative to the field, in the field's frame
//   double scale;    metres per unit
//   Hint hint;       speeds up a sample nearby
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/shapes/path.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// Returns true if a point inside a level set is within a voxel's diagonal of the edge of its band. There the field
// flattens, so that its slope says nothing about the distance, which is at least |phi|.
inline bool is_at_band_edge(double phi, double band, double voxel) { return -phi > band - std::sqrt(3.0) * voxel; }

// The root search at the end of every walk to a contact, between a time when the path is outside the shape and one when
// it is inside.

struct Bracket {
    double before, height_before;  // s along the path; height >= 0
    double after, height_after;    // height < 0
};

// Returns the time of the crossing in a bracket, on its outer side (height >= 0). The bracket is narrowed until the
// height is at most `close` (m), the path within it is at most `close` long at this speed (m/s), or the rounding of the
// time is reached. The method is regula falsi with the Illinois rule, plus bisection.
template <class Height>
double crossing_time(const Height& height, const Bracket& bracket, double speed, double close)
{
    double before = bracket.before, f_before = bracket.height_before;
    double after = bracket.after, f_after = bracket.height_after;
    double outer = f_before;   // as sampled; the Illinois rule halves f_before and f_after
    int kept = 0;              // consecutive steps that kept the same end: +1, +2, ... before, -1, -2, ... after
    constexpr int most = 200;  // far more than bisection alone needs for 53 bits
    for (int i = 0; i < most && outer > close; ++i) {
        if (after - before <= 0x1p-52 * after || speed * (after - before) <= close) break;
        // Every fourth step is a bisection, which converges even if a kink of the field stalls regula falsi.
        double s = i % 4 == 3 ? 0.5 * (before + after) : before + (after - before) * f_before / (f_before - f_after);
        if (!(s > before && s < after)) s = 0.5 * (before + after);
        if (!(s > before && s < after)) break;
        const double f = height(s);
        if (f >= 0) {
            before = s, f_before = outer = f;
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

// The distance from the surface up to which a sample must be exact. Farther out it may be a cheaper bound.
enum class Exact {
    InStep,   // within a feature of the level
    AtStart,  // within two features of the radius
    InBand,
};

struct NoHint {};

// Returns the step of a general field: the travel time of the distance that the field's slope bound allows, at least a
// quarter of a feature.
inline double general_step(double height, double slope_bound, double feature, double speed, double acceleration)
{
    return time_to_travel(std::max(height / slope_bound, feature / 4), speed, acceleration);
}

// Returns the step of a convex field. Its distance is a convex function, so along the path f'' >= n·a >= -|a|, and
//
//   f(s + τ) >= f + f' τ - |a| τ²/2.
//
// A walk to the root of the right side never passes the surface. Unlike a walk by a bound on the slope alone, it
// converges quadratically, like Newton's method.
inline double convex_step(double height, double slope, double acceleration)
{
    const double approaching = -slope;
    if (acceleration == 0 && approaching <= 0) return Contact::none;
    const double root = std::sqrt(approaching * approaching + 2 * acceleration * height);
    return approaching > 0 ? 2 * height / (approaching + root) : (root - approaching) / acceleration;
}

// Returns how much the normal turns along the direction of the velocity, per distance along the surface, 1/m.
template <class Field>
double curvature_at(const Field& field, double s, const Vec3d& n, const typename Field::Sample& here)
{
    const Vec3d tangent = here.velocity - n.dot(here.velocity) * n;
    const double speed = tangent.norm(), feature = field.smallest_feature();
    if (!(speed > 0)) return 0;
    const double ahead = feature > 0 ? feature / 2 : 0x1p-20 * field.bounds().sizes().maxCoeff();
    if (!std::isfinite(ahead)) return 0;
    const Vec3d gradient = field.gradient_at(here.X + ahead / speed * tangent, s, here);
    const double size = gradient.norm();
    return size > 0 ? tangent.dot(gradient / size - n) / (speed * ahead * here.scale) : 0;
}

// Returns the contact of a path that is on the surface at time s. soon: a time shortly after s, for fields with kinks.
template <class Field>
Contact contact_at(const Field& field, double s, typename Field::Hint hint, double soon = 0)
{
    const auto here = field.at(s, hint, Exact::InBand);
    Vec3d gradient = here.gradient;
    if (soon > s && gradient.dot(here.velocity) >= 0) {
        // The path is on a kink of the field and still on the side that it leaves. The surface that it meets is ahead.
        const auto ahead = field.at(soon, hint, Exact::InBand);
        if (field.approach_speed(ahead, here) < 0) gradient = ahead.gradient;
    }
    const Vec3d n = unit_normal(gradient, here.velocity);
    Contact contact = field.contact(s, n, here);
    contact.curvature = curvature_at(field, s, n, here);
    return contact;
}

template <class Field>
class ContactWalk {
public:
    using Sample = typename Field::Sample;

    // Starts at time s, where the field is `start`. The walk ends at time `end` of the path.
    ContactWalk(const Field& field, const Sample& start, double s, double end)
        : field_(field), here_(start), s_(s), end_(end)
    {
    }

    const Field& field() const { return field_; }
    double time() const { return s_; }
    const Sample& here() const { return here_; }
    bool is_over() const { return over_; }
    const Contact& contact() const { return contact_; }  // its time is infinite unless there is one

    // Starts a path that is flush with the surface. If the path moves inwards, this is a contact. Otherwise the path
    // leaves or is pressed inwards, possibly after rising by no more than rounding. The test is then its position after
    // a hop that lifts it by at most `lift`. From there the walk continues as usual, and may return within a feature.
    void leave_surface(double lift)
    {
        if (here_.slope < 0 && !is_along(here_.slope, here_.velocity)) return touch(s_);
        const double acceleration = field_.acceleration(), feature = field_.smallest_feature();
        double hop = Contact::none;
        if (acceleration > 0) hop = 2 * std::sqrt(lift / acceleration);
        if (feature > 0 && here_.slope > 0) hop = std::min(hop, lift / here_.slope);
        if (!(hop < Contact::none)) return;
        const double speed = here_.velocity.norm();
        if (feature > 0 && hop * speed > feature / 4) hop = feature / (4 * speed);
        const double after = std::min(end_, s_ + hop);
        const Sample there = field_.at(after, here_.hint, Exact::AtStart);
        if (there.height < 0) return touch(after);
        s_ = after;
        here_ = there;
    }

    // Chooses the time of the next sample. Returns false if the walk is over.
    bool proceeds()
    {
        constexpr int most = 500;  // steps to a convex shape; a graze halves the distance each time, below 200 times
        if (is_convex() && !over_) {
            const double close = field_.close(here_);
            if (here_.height <= close) {
                // A departing point that grazes the surface has no contact.
                if (here_.slope < 0 && !is_along(here_.slope, here_.velocity)) touch(s_);
                here_.height = close;
            }
            if (!over_ && steps_ >= most) touch(s_);
        }
        if (over_ || !(s_ < end_)) return over_ = true, false;
        hop_ = field_.hop(here_);
        next_ = s_ + std::max(field_.step(s_, here_), hop_);
        if (!(next_ < end_)) {
            if (field_.open_ended()) return over_ = true, false;
            next_ = end_;
        }
        return true;
    }
    double next() const { return next_; }

    // Processes the sample at next().
    void advance(const Sample& there)
    {
        if (!(next_ > s_)) return touch(s_);  // the step is below the rounding of the time
        if (there.height < 0) {
            if (is_convex() && hop_ > 0) return touch(s_);
            if (!is_convex()) return cross(there);
        }
        s_ = next_;
        here_ = there;
        ++steps_;
    }

    // Runs the whole walk and returns its contact.
    const Contact& walk()
    {
        while (proceeds()) advance(field_.at(next_, here_.hint, Exact::InStep));
        return contact_;
    }

private:
    bool is_convex() const { return !(field_.smallest_feature() > 0); }

    void touch(double soon)
    {
        contact_ = contact_at(field_, s_, here_.hint, soon);
        over_ = true;
    }

    // Finds the contact within a step that ends inside the surface.
    void cross(const Sample& there)
    {
        const double s = crossing_time([&](double t) { return field_.height(t, there.hint); },
                                       {s_, here_.height, next_, there.height}, field_.fastest(s_, here_, next_),
                                       field_.close(there));
        contact_ = contact_at(field_, s, there.hint, s + Field::kink * (next_ - s_));
        over_ = true;
    }

    Field field_;
    Sample here_;
    double s_, end_, next_ = 0;
    double hop_ = 0;
    int steps_ = 0;
    bool over_ = false;
    Contact contact_;
};

}  // namespace rapid

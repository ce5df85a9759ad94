// The walk along a path to its first contact, by conservative advancement: each step is one that a bound on the field
// shows to be free of the surface (docs/numerics.md, Collision). Static, rigid and deforming fields share it.
//
// Field is a distance field as one path meets it:
//
//   Sample at(double s, Hint, Exact) const;      the field on the path at time s
//   double height(double s, Hint) const;         Sample::height alone
//   Vec3d gradient_at(const Vec3d& X, double s, const Sample& here) const;    near a sample, in the field's frame
//   Contact contact(double s, const Vec3d& n, const Sample& here) const;      time, normal and velocity, in the world
//
//   double step(double s, const Sample& here) const;    s that are free of the surface, or short of any feature
//   double hop(const Sample& here) const;               s, where a longer step may dip into the surface by rounding
//   double fastest(double s, const Sample& here, double after) const;    bound on the relative speed from s to after
//   double approach_speed(const Sample& ahead, const Sample& here) const;    slope at a sample soon after another
//   double acceleration() const;                        bound on the relative acceleration
//   double close(const Sample&) const;                  the height that counts as touching
//   double smallest_feature() const;                    0: the field is convex
//   Box3d bounds() const;
//   bool open_ended() const;                            a contact at the very end of the path is none
//   static constexpr double kink;                       part of a step, for contact_at()
//
// with lengths in metres, or in the rest units of a shape that is scaled. Sample has
//
//   double height;     above the level that the path touches at; from 0 outside
//   double slope;      its derivative by s
//   Vec3d X;           position in the field's frame
//   Vec3d gradient;    not normalised; zero where there is none
//   Vec3d velocity;    of the path relative to the field, in the field's frame
//   double scale;      m a unit
//   Hint hint;         what makes a sample nearby cheaper
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/shapes/crossing.h"
#include "runtime/shapes/path.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// How far from the surface a sample has to be a distance; farther out it may be a bound of it, which costs less.
enum class Exact {
    InStep,   // within a feature of the level
    AtStart,  // within two features of the radius
    InBand,
};

struct NoHint {};

// A step of a general field: along the distance that the slope of the field allows, or a quarter of a feature.
inline double general_step(double height, double slope_bound, double feature, double speed, double acceleration)
{
    return time_to_travel(std::max(height / slope_bound, feature / 4), speed, acceleration);
}

// A step of a convex field. Its distance is a convex function, so along the path f'' >= n·a >= -|a|, and
//
//   f(s + τ) >= f + f' τ - |a| τ²/2.
//
// The walk to the root of the right side never passes the surface and, unlike that by a mere bound on the slope,
// converges quadratically, as Newton's method does.
inline double convex_step(double height, double slope, double acceleration)
{
    const double approaching = -slope;
    if (acceleration == 0 && approaching <= 0) return Contact::none;
    const double root = std::sqrt(approaching * approaching + 2 * acceleration * height);
    return approaching > 0 ? 2 * height / (approaching + root) : (root - approaching) / acceleration;
}

// How the normal turns towards the velocity, a short distance ahead along the surface, 1/m.
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

// The contact of a path that is on the surface at time s. soon: s, a time shortly after, of a field with kinks.
template <class Field>
Contact contact_at(const Field& field, double s, typename Field::Hint hint, double soon = 0)
{
    const auto here = field.at(s, hint, Exact::InBand);
    Vec3d gradient = here.gradient;
    if (soon > s && gradient.dot(here.velocity) >= 0) {
        // On a kink of the field, and still on the side that the path leaves by: the surface that it meets is ahead.
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

    // From time s, where the field is `start`, to time `end` of the path.
    ContactWalk(const Field& field, const Sample& start, double s, double end)
        : field_(field), here_(start), s_(s), end_(end)
    {
    }

    const Field& field() const { return field_; }
    double time() const { return s_; }
    const Sample& here() const { return here_; }
    bool is_over() const { return over_; }
    const Contact& contact() const { return contact_; }  // its time is infinite until one is found

    // Begins a path that is flush with the surface: a contact where it moves inwards. Where it leaves, or is pressed
    // inwards though it may still move outwards by less than will lift it by more than rounding, the test is where it
    // is after such a hop, which lifts it by `lift` at most. From there it is a path as any other, which may come back
    // within a feature.
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

    // Chooses the time of the next sample; false where the walk is over.
    bool proceeds()
    {
        constexpr int most = 500;  // steps to a convex shape: a graze halves the distance each time, below 200 times
        if (is_convex() && !over_) {
            const double close = field_.close(here_);
            if (here_.height <= close) {
                // The graze of a point that is leaving is no contact.
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

    // Takes the sample at next().
    void advance(const Sample& there)
    {
        if (!(next_ > s_)) return touch(s_);  // below the rounding of the time
        if (there.height < 0) {
            if (is_convex() && hop_ > 0) return touch(s_);
            if (!is_convex()) return cross(there);
        }
        s_ = next_;
        here_ = there;
        ++steps_;
    }

    // The contact of the whole walk.
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

    // The step from here ends inside the surface.
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

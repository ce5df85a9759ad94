// Adapts the sampler of a static shape (see ShapeOf) to ContactWalk, as seen from one path.
#pragma once

#include "runtime/shapes/contact_walk.h"

namespace rapid {

// Returns the error of a sampler's distance, m.
template <class Sampler>
double rounding_of(const Sampler& sampler)
{
    if constexpr (requires { sampler.rounding(); })
        return sampler.rounding();
    else
        return 0x1p-21 * sampler.smallest_feature();
}

template <class Sampler>
struct StaticField {
    using Hint = NoHint;
    struct Sample {
        double height;
        Vec3d X, gradient, velocity;
        double slope;
        static constexpr double scale = 1;
        static constexpr Hint hint = {};
    };
    static constexpr double kink = 0;

    const Sampler& sampler;
    const Path& path;
    double level;  // m

    Sample at(double s, Hint, Exact) const
    {
        Sample sample;
        sample.X = path.at(s);
        sample.velocity = path.velocity(s);
        sample.height = sampler.distance(sample.X, sample.gradient) - level;
        sample.slope = sample.gradient.dot(sample.velocity);
        return sample;
    }
    double height(double s, Hint) const { return sampler.distance(path.at(s)) - level; }
    Vec3d gradient_at(const Vec3d& X, double, const Sample&) const
    {
        Vec3d gradient;
        sampler.distance(X, gradient);
        return gradient;
    }
    Contact contact(double s, const Vec3d& n, const Sample&) const
    {
        Contact contact;
        contact.time = s;
        contact.n = n;
        return contact;
    }

    double step(double, const Sample& here) const
    {
        const double feature = sampler.smallest_feature(), a = path.a.norm();
        if (!(feature > 0)) return convex_step(here.height, here.slope, a);
        return general_step(here.height, sampler.slope_bound(), feature, here.velocity.norm(), a);
    }
    double hop(const Sample&) const { return 0; }
    double fastest(double, const Sample&, double after) const { return path.v.norm() + after * path.a.norm(); }
    double approach_speed(const Sample& ahead, const Sample& here) const { return ahead.gradient.dot(here.velocity); }
    double acceleration() const { return path.a.norm(); }
    double close(const Sample&) const { return touching_within(path, rounding_of(sampler)); }
    double smallest_feature() const { return sampler.smallest_feature(); }
    Box3d bounds() const { return sampler.bounds(); }
    bool open_ended() const { return !(sampler.smallest_feature() > 0); }
};

}  // namespace rapid

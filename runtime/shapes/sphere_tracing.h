// Sphere tracing of many paths at once through a static, non-convex field, one step of each path in turn. The samples
// are independent, and the loops over them are free of branches.
//
// At height f >= 0 the path is free within D = f / L, both ahead and back. The next sample is therefore taken farther
// ahead than D, so far that its own D is predicted to reach back and close the gap. The prediction uses the slope of
// the field along the path so far (auto-relaxed sphere tracing, Bán and Valasek 2023). If the gap stays open, its near
// end is sampled instead. Steps are at least a quarter of the smallest feature, so that the walk ends, either at the
// end of the path or with a change of sign that is then refined. No wall as thick as two features is stepped over.
#pragma once

#include <span>

#include "runtime/shapes/contact_walk.h"

namespace rapid {

// Adapts the sampler of a static shape (see ShapeOf) to ContactWalk, as seen from one path.

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

// Evaluates many distances, with the sampler's own loop if it has one.
template <class Sampler>
void sample_distances(const Sampler& sampler, int n, const double* X, const double* Y, const double* Z, double* phi)
{
    if constexpr (requires { sampler.distances(n, X, Y, Z, phi); })
        sampler.distances(n, X, Y, Z, phi);
    else
        for (int k = 0; k < n; ++k) phi[k] = sampler.distance({X[k], Y[k], Z[k]});
}

// Layout: structure of arrays; coordinates are shape [3, most].
template <class Sampler>
class SphereTracing {
public:
    SphereTracing(const Sampler& sampler, std::span<const Path> paths, std::span<Contact> contacts)
        : sampler_(sampler), paths_(paths), contacts_(contacts)
    {
    }

    // Adds path i from time s on, where the field is f above `level`. slope: the derivative of f at s, m/s.
    void begin(std::size_t i, double s, double f, double slope, double level)
    {
        const Path& path = paths_[i];
        const double T = path.duration;
        if (!reach_speed(i, s, f, slope, level)) return;
        // The speed is a convex function of time, so its maximum is at an end.
        const double fastest = std::sqrt(std::max(path.velocity(s).squaredNorm(), path.velocity(T).squaredNorm()));
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
        path_[k] = i;
        if (n_ == most) finish();
    }

    // Walks all paths to their ends and writes their contacts.
    void finish()
    {
        while (n_ > 0) step();
    }

private:
    static constexpr int most = 64;
    static constexpr double much_faster = 64, a_world = 1e6;  // ratio of speeds; distance in features
    // Fraction of the predicted step that is used; largest slope away from the surface and longest step, in D, that are
    // relied on.
    static constexpr double cautious = 0.9, flattest = 0.9, farthest = 4;

    // Handles a path that is slow at first and ends very far away. Steps by the largest speed ahead would take forever,
    // so each step uses the path's own speed and acceleration until the speed is comparable to that at the end. Returns
    // false if the walk ended meanwhile, with or without a contact.
    bool reach_speed(std::size_t i, double& s, double& f, double& slope, double level)
    {
        const Path& path = paths_[i];
        const double feature = sampler_.smallest_feature(), T = path.duration;
        if (!(feature > 0) || !(0.5 * path.a.norm() * T * T > a_world * feature)) return true;
        const StaticField<Sampler> field{sampler_, path, level};
        typename StaticField<Sampler>::Sample start{};
        start.height = f;
        start.slope = slope;
        start.velocity = path.velocity(s);
        ContactWalk walk(field, start, s, T);
        const double end = path.velocity(T).norm();
        while (end > much_faster * walk.here().velocity.norm() && walk.proceeds() && walk.next() > walk.time()) {
            walk.advance(field.at(walk.next(), {}, Exact::InStep));
            if (!walk.is_over()) continue;
            contacts_[i] = walk.contact();
            return false;
        }
        s = walk.time();
        f = walk.here().height;
        slope = walk.here().slope;
        return s < T;
    }

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
            f[k] = sampler_.distance(paths_[path_[k]].at(next[k])) - level_[k];
        }

        bool over[most];
        for (int k = 0; k < n_; ++k) {
            const double before = s_[k], slope = (f[k] - f_[k]) * per_f_[k] / (next[k] - before);
            // The last condition: a step below the rounding of the time ends the walk.
            over[k] = (f[k] < 0) | (next[k] + f[k] * per_f_[k] >= T_[k]) | !(next[k] > before);
            slope_[k] = std::min(slope, flattest);
        }
        int still = 0;
        for (int k = 0; k < n_; ++k) {
            if (over[k]) {
                if (f[k] < 0 && next[k] > s_[k]) cross(k, next[k], f[k]);
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
        sample_distances(sampler_, n_, x[0], x[1], x[2], f);
        for (int k = 0; k < n_; ++k) f[k] -= level_[k];
    }

    void cross(int k, double next, double f)
    {
        const StaticField<Sampler> field{sampler_, paths_[path_[k]], level_[k]};
        const double s = crossing_time([&](double t) { return field.height(t, {}); }, {s_[k], f_[k], next, f},
                                       field.fastest(s_[k], {}, next), field.close({}));
        contacts_[path_[k]] = contact_at(field, s, {}, s + 0x1p-8 * least_[k]);
    }

    void move(int from, int to)
    {
        for (int axis = 0; axis < 3; ++axis)
            for (auto* x : {P_[axis], v_[axis], a_[axis]}) x[to] = x[from];
        for (double* x : {T_, s_, f_, per_f_, least_, slope_, level_}) x[to] = x[from];
        path_[to] = path_[from];
    }

    const Sampler& sampler_;
    std::span<const Path> paths_;
    std::span<Contact> contacts_;

    int n_ = 0;
    std::size_t path_[most];
    double P_[3][most], v_[3][most], a_[3][most], T_[most];
    double s_[most], f_[most];  // time, s, and height above the level, m
    double per_f_[most];        // free time per metre of height, s/m
    double least_[most];        // shortest step, s
    double slope_[most];        // of the field along the path, as a fraction of the steepest possible: -1 to 1
    double level_[most];
};

}  // namespace rapid

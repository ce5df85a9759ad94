// A pair of level sets of a sequence during an interval (level_set_sequence.h).
#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/shapes/motion/moving_contact.h"

namespace rapid {
namespace {

constexpr double min_slope2 = 0.25;  // near 0 the two gradients cancel, and the surface velocity would be unbounded

class BlendedDistance {
public:
    explicit BlendedDistance(const BlendedInterval& interval)
        : a_(std::static_pointer_cast<const BakedLevelSet>(interval.a)),
          b_(std::static_pointer_cast<const BakedLevelSet>(interval.b)),
          begin_(interval.begin),
          end_(interval.end),
          duration_(interval.duration),
          rate_(duration_ > 0 ? (end_ - begin_) / duration_ : 0),
          travel_(interval.travel)
    {
    }

    struct Sample {
        double phi;
        Vec3d gradient;
        Vec3d vc;  // velocity of the surface, m/s
    };
    Sample at(const Vec3d& P, double time, double = 0) const
    {
        Vec3d slope_a, slope_b;
        const double a = a_->sampler().distance(P, slope_a), b = b_->sampler().distance(P, slope_b);
        const double part = part_of(time);
        Sample sample{a + part * (b - a), slope_a + part * (slope_b - slope_a), Vec3d::Zero()};
        sample.vc = -rate_ * (b - a) / std::max(sample.gradient.squaredNorm(), min_slope2) * sample.gradient;
        return sample;
    }
    double distance(const Vec3d& P, double time) const
    {
        const double a = a_->sampler().distance(P), b = b_->sampler().distance(P);
        return a + part_of(time) * (b - a);
    }

    // Returns the position at `to` of the material that is at P at `from`: integrates its velocity in steps of a
    // fraction of a voxel, then restores its distance from the surface.
    Vec3d flow(Vec3d P, double from, double to) const
    {
        const double level = distance(P, from);
        const int steps = std::clamp(static_cast<int>(std::ceil(4 * fastest() * std::abs(to - from) / voxel())), 1, 64);
        const double h = (to - from) / steps;
        for (int k = 0; k < steps; ++k) {
            const double t = from + k * h;
            const Vec3d v1 = at(P, t).vc, v2 = at(P + 0.5 * h * v1, t + 0.5 * h).vc;
            const Vec3d v3 = at(P + 0.5 * h * v2, t + 0.5 * h).vc, v4 = at(P + h * v3, t + h).vc;
            P += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
        }
        const Sample there = at(P, to);
        const double slope2 = there.gradient.squaredNorm();
        return slope2 > min_slope2 ? Vec3d(P - (there.phi - level) / slope2 * there.gradient) : P;
    }

    // Returns the rate of change of the surface velocity along a point that moves from P with v, m/s².
    Vec3d change(const Vec3d& P, const Vec3d& v, double time) const
    {
        if (!(duration_ > 0)) return Vec3d::Zero();
        const double h = duration_ / 32, from = std::max(0.0, time - h), to = std::min(duration_, time + h);
        return (at(P + (to - time) * v, to).vc - at(P + (from - time) * v, from).vc) / (to - from);
    }
    // Returns the part of it due to a motion along the surface with this velocity, at a fixed time.
    Vec3d change_along(const Vec3d& P, const Vec3d& velocity, double time) const
    {
        const double speed = velocity.norm();
        if (!(speed > 0)) return Vec3d::Zero();
        const double h = 0.5 * voxel() / speed;
        return (at(P + h * velocity, time).vc - at(P - h * velocity, time).vc) / (2 * h);
    }

    double duration() const { return duration_; }
    const LevelSet& end() const { return end_ < 0.5 ? *a_ : *b_; }
    double band() const { return std::min(a_->band(), b_->band()); }
    double slope_bound() const { return std::max(a_->slope_bound(), b_->slope_bound()); }
    double voxel() const { return std::max(a_->voxel(), b_->voxel()); }
    double rounding() const { return 0x1p-21 * std::max(a_->band(), b_->band()); }  // m
    double max_change() const { return travel_ * std::abs(rate_); }                 // bound on |dphi/dt|, m/s
    double fastest() const { return max_change() / std::sqrt(min_slope2); }         // bound on the surface's speed, m/s
    double most_curved(double speed) const { return 2 * slope_bound() * std::abs(rate_) * speed; }  // m/s²
    std::uint64_t active_voxels() const { return a_->active_voxels() + b_->active_voxels(); }
    Box3d bounds() const { return a_->bounds().merged(b_->bounds()); }

private:
    double part_of(double time) const
    {
        return duration_ > 0 ? begin_ + (end_ - begin_) * std::clamp(time / duration_, 0.0, 1.0) : end_;
    }

    std::shared_ptr<const BakedLevelSet> a_, b_;
    double begin_, end_, duration_, rate_;  // weight of b; weight of b; s; 1/s
    double travel_;                         // m
};

// Adapts BlendedDistance to ContactWalk, as seen from one path.
struct BlendedField {
    using Hint = NoHint;
    struct Sample {
        double height;
        Vec3d X, gradient, velocity, vc;
        double slope;
        Hint hint = {};
        static constexpr double scale = 1;
    };
    static constexpr double kink = 0x1p-8;

    const BlendedDistance& body;
    const Path& path;
    double level;  // m

    static double exact_within(Exact) { return 0; }

    Sample sample(double s, double height, const BlendedDistance::Sample& there) const
    {
        Sample sample{height, path.at(s), there.gradient, path.velocity(s) - there.vc, there.vc, 0};
        sample.slope = sample.gradient.dot(sample.velocity);
        return sample;
    }
    Sample at(double s, Hint, Exact) const
    {
        const auto there = body.at(path.at(s), path.begin + s);
        return sample(s, there.phi - level, there);
    }
    double height(double s, Hint) const { return body.distance(path.at(s), path.begin + s) - level; }
    Vec3d gradient_at(const Vec3d& X, double s, const Sample&) const { return body.at(X, path.begin + s).gradient; }
    Contact contact(double s, const Vec3d& n, const Sample& here) const
    {
        Contact contact;
        contact.time = s;
        contact.n = n;
        contact.vc = here.vc;
        return contact;
    }

    double top_speed() const { return std::max(path.velocity(0).norm(), path.velocity(path.duration).norm()); }

    // Returns a step that is free of the surface, or a quarter of a voxel of relative travel if that is longer.
    double step(double, const Sample& here) const
    {
        const double closing = body.slope_bound() * top_speed() + body.max_change();
        if (!(closing > 0)) return path.duration;
        return std::max(here.height / closing, body.voxel() / 4 / (top_speed() + body.fastest()));
    }
    double hop(const Sample&) const { return 0; }
    double fastest(double s, const Sample&, double) const
    {
        return path.velocity(s).norm() + path.duration * path.a.norm() + body.fastest();
    }
    double approach_speed(const Sample& ahead, const Sample&) const { return ahead.gradient.dot(ahead.velocity); }
    double acceleration() const { return path.a.norm() + body.most_curved(top_speed()); }
    double close(const Sample&) const { return touching_within(path, body.rounding()); }
    double smallest_feature() const { return body.voxel(); }
    Box3d bounds() const { return body.bounds(); }
    bool open_ended() const { return false; }
};

class Blended final : public BlendedLevelSets {
public:
    explicit Blended(BlendedInterval interval)
        : body_(interval), bounds_(body_.bounds()), tag_(interval.tag), widen_(std::move(interval.widen))
    {
    }

    std::string_view kind() const override { return "level set"; }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return body_.band(); }
    double slope_bound() const override { return body_.slope_bound(); }
    double smallest_feature() const override { return body_.voxel(); }
    bool moves() const override { return true; }
    double voxel() const override { return body_.voxel(); }
    std::uint64_t active_voxels() const override { return body_.active_voxels(); }
    std::shared_ptr<const Mesh> surface() const override { return body_.end().surface(); }
    std::shared_ptr<const BlendedLevelSets> with_band(double metres) const override { return widen_(metres); }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, body_.duration(), phi, gradient);
    }
    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, time[i], phi, gradient);
    }
    Vec3d velocity_at(const Vec3d& P, double time) const override { return body_.at(P, time).vc; }

    // Returns the surface's acceleration for a point with velocity v. The surface turns under a point that slips along
    // it. As with the Coriolis acceleration, the slip counts twice.
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        const Vec3d vc = velocity_at(P, time);
        return body_.change(P, vc, time) + 2 * body_.change_along(P, v - vc, time);
    }
    MaterialPoint material_at(const Vec3d& P, double time) const override { return {tag_, body_.flow(P, time, 0)}; }
    bool has(const MaterialPoint& point) const override { return point.face == tag_; }
    State follow(const MaterialPoint& point, double time) const override
    {
        const Vec3d P = body_.flow(point.at, 0, time), v = velocity_at(P, time);
        return {P, v, body_.change(P, v, time)};
    }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        for (std::size_t i = 0; i < paths.size(); ++i)
            contacts[i] = may_reach(paths[i], bounds_) ? first_contact_of<BlendedField>(body_, paths[i]) : Contact();
    }

private:
    void sample(std::size_t i, std::span<const Vec3d> P, double time, std::span<double> phi,
                std::span<Vec3d> gradient) const
    {
        const BlendedDistance::Sample there = body_.at(P[i], time);
        phi[i] = there.phi;
        if (!gradient.empty()) gradient[i] = there.gradient;
    }

    BlendedDistance body_;
    Box3d bounds_;
    std::int32_t tag_;
    std::function<std::shared_ptr<const BlendedLevelSets>(double)> widen_;
};

}  // namespace

std::shared_ptr<const BlendedLevelSets> blended_level_sets(BlendedInterval interval)
{
    return std::make_shared<Blended>(std::move(interval));
}

}  // namespace rapid

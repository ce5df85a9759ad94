// Finds the first contacts of paths with a moving shape, within one piece of its motion.
#pragma once

#include <span>
#include <vector>

#include "runtime/shapes/contact_walk.h"
#include "runtime/shapes/motion/motion.h"

namespace rapid {

// Adapts a rest shape that moves along one piece of its track to ContactWalk, as seen from one path.

// A path in the frame of a shape, within one piece of its motion. Lengths are in rest units: metres of the rest shape.
class RelativePath {
public:
    // Covers the path between two of its times.
    RelativePath(const MotionTrack::Piece& piece, const Path& path, double first, double last);

    struct State {
        Vec3d X, velocity;  // rest units, rest units per s
        double scale;       // m per rest unit
        Eigen::Quaterniond rotation;
        double level_rate;  // 1/s: rate of decrease of 1/scale
    };
    State at(double s) const;
    // Returns the velocity of the surface at the position of the path, m/s.
    Vec3d surface_velocity(double s) const { return piece_->velocity_at(path_->begin + s).at(path_->at(s)); }

    // Bounds over the whole time. For a path that touches at a level above 0 (m), they apply to its distance from that
    // level.
    double acceleration(double level) const { return acceleration_ + std::abs(level) * level_acceleration_; }
    double level_speed(double level) const { return std::abs(level) * level_speed_; }

    const MotionTrack::Piece& piece() const { return *piece_; }
    const Path& path() const { return *path_; }

private:
    struct Arm {
        Vec3d arm, relative_velocity;  // relative to the origin of the shape's frame, in world space
        Eigen::Quaterniond rotation;
        double scale;
    };
    Arm arm_at(double s) const;

    const MotionTrack::Piece* piece_;
    const Path* path_;
    double first_;
    Arm begin_;  // at the first time, which is requested most often
    double acceleration_, level_speed_, level_acceleration_;
};

// The rest shape and the values that all paths share.
struct RestShape {
    explicit RestShape(ShapePtr rest);

    ShapePtr shape;
    double slope_bound, feature;
    double rounding;  // error of a distance, rest units

    bool is_convex() const { return !(feature > 0); }
    double distance(const Vec3d& X, Vec3d& gradient) const
    {
        double phi = 0;
        shape->distance({&X, 1}, {&phi, 1}, {&gradient, 1});
        return phi;
    }
};

class RigidField {
public:
    using Hint = NoHint;
    struct Sample : RelativePath::State {
        Vec3d gradient;
        double height, slope;
        static constexpr Hint hint = {};
    };
    static constexpr double kink = 0x1p-8;

    // level: height of the path above the surface, m, at which it touches.
    RigidField(const RestShape& rest, const RelativePath& path, double level) : rest_(&rest), path_(path), level_(level)
    {
    }

    const RelativePath& path() const { return path_; }
    double level() const { return level_; }

    // Creates a sample from the distance at a state of the path.
    Sample sample(const RelativePath::State& state, double phi, const Vec3d& gradient) const
    {
        return {state, gradient, phi - level_ / state.scale, gradient.dot(state.velocity) + level_ * state.level_rate};
    }
    Sample at(double s, Hint, Exact) const
    {
        const RelativePath::State state = path_.at(s);
        Vec3d gradient;
        const double phi = rest_->distance(state.X, gradient);
        return sample(state, phi, gradient);
    }
    double height(double s, Hint hint) const { return at(s, hint, Exact::InStep).height; }
    Vec3d gradient_at(const Vec3d& X, double, const Sample&) const
    {
        Vec3d gradient;
        rest_->distance(X, gradient);
        return gradient;
    }
    Contact contact(double s, const Vec3d& n, const Sample& here) const
    {
        Contact contact;
        contact.time = s;
        contact.n = here.rotation * n;
        contact.vc = path_.surface_velocity(s);
        return contact;
    }

    double step(double, const Sample& here) const
    {
        if (rest_->is_convex()) return convex_step(here.height, here.slope, acceleration());
        const double speed = here.velocity.norm() + path_.level_speed(level_) / rest_->slope_bound;
        return general_step(here.height, rest_->slope_bound, rest_->feature, speed, acceleration());
    }
    // Returns the shortest step. Along a face of a convex shape and flush with it, the acceleration bound would shrink
    // steps to the size of rounding.
    double hop(const Sample& here) const
    {
        if (!rest_->is_convex() || !(acceleration() > 0)) return 0;
        const double near = flush(here.scale) / here.scale;
        return here.height <= near && here.slope * here.slope <= 2 * acceleration() * near
                   ? 2 * std::sqrt(2 * near / acceleration())
                   : 0;
    }
    double fastest(double s, const Sample& here, double after) const
    {
        return here.velocity.norm() + (after - s) * acceleration();
    }
    double approach_speed(const Sample& ahead, const Sample&) const { return ahead.gradient.dot(ahead.velocity); }
    double acceleration() const { return path_.acceleration(level_); }
    double close(const Sample& here) const { return touching_within(path_.path(), rest_->rounding, here.scale); }
    double smallest_feature() const { return rest_->feature; }
    Box3d bounds() const { return rest_->shape->bounds(); }
    bool open_ended() const { return false; }

    // Returns the height that counts as flush with the surface, m.
    double flush(double scale) const
    {
        return flush_within(path_.path().P, path_.path().radius, scale * rest_->rounding);
    }

private:
    const RestShape* rest_;
    RelativePath path_;
    double level_;
};

class RigidContacts {
public:
    // Both must outlive this.
    RigidContacts(const RestShape& rest, const MotionTrack::Piece& piece, std::span<const Path> paths,
                  std::span<Contact> contacts)
        : rest_(rest), piece_(piece), paths_(paths), contacts_(contacts)
    {
    }

    // Adds path i between two of its times.
    void add(std::size_t i, double from, double to)
    {
        beginnings_.push_back({i, RelativePath(piece_, paths_[i], from, to), from, to});
    }

    // Writes the contacts of the paths that have one.
    void find();

private:
    struct Beginning {
        std::size_t path;
        RelativePath relative;
        double from, to;
    };
    struct Walker {
        std::size_t path;
        double end;
        ContactWalk<RigidField> walk;
    };

    void begin(const Beginning& beginning, const RelativePath::State& here, double phi, const Vec3d& gradient);
    Contact inside(const Beginning& beginning, const RelativePath::State& here) const;
    void fly_straight();
    void walk();

    const RestShape& rest_;
    const MotionTrack::Piece& piece_;
    std::span<const Path> paths_;
    std::span<Contact> contacts_;
    std::vector<Beginning> beginnings_;
    std::vector<Walker> walkers_;
};

}  // namespace rapid

#include "runtime/shapes/motion/deforming_shape.h"

#include <algorithm>
#include <cmath>

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/last_outside.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/motion/moving_triangles.h"

namespace rapid {
namespace {

using GridPtr = std::shared_ptr<const GridLevelSet>;

class DeformingShape final : public Shape {
public:
    // begin: null where the interval begins with a jump; then the end's goes back along the ways.
    DeformingShape(GridPtr begin, GridPtr end, MovingTriangles faces, double duration)
        : begin_(std::move(begin)),
          end_(std::move(end)),
          faces_(std::move(faces)),
          duration_(duration),
          fastest_(faces_.fastest() / duration),
          curved_(faces_.most_curved() / (duration * duration)),
          rounding_(0x1p-21 * end_->band())
    {
        const Vec3d margin = Vec3d::Constant(end_->voxel());
        bounds_ = {faces_.bounds().min() - margin, faces_.bounds().max() + margin};
    }

    std::string_view kind() const override { return "level set"; }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return begin_ ? std::min(begin_->band(), end_->band()) : end_->band(); }
    double slope_bound() const override
    {
        return begin_ ? std::max(begin_->slope_bound(), end_->slope_bound()) : end_->slope_bound();
    }
    double smallest_feature() const override { return end_->voxel(); }
    bool moves() const override { return true; }
    MeshPtr surface() const override { return end_->surface(); }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        end_->distance(P, phi, gradient);
    }

    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) {
            const Sample sample = ask(P[i], time[i], band());
            phi[i] = sample.phi;
            if (!gradient.empty()) gradient[i] = sample.gradient;
        }
    }

    Vec3d velocity_at(const Vec3d& P, double time) const override
    {
        const double t = part_of(time);
        return faces_.velocity(faces_.nearest(P, t), t) / duration_;
    }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        for (std::size_t i = 0; i < paths.size(); ++i)
            contacts[i] = may_reach(paths[i], bounds_) ? first_contact(paths[i]) : Contact();
    }

private:
    struct Sample {
        double phi;
        Vec3d gradient;          // of about length 1; zero where phi is only a bound, outside
        std::int32_t near = -1;  // triangle, where one was looked for
        Vec3d vc = Vec3d::Zero();
    };

    double part_of(double time) const { return std::clamp(time / duration_, 0.0, 1.0); }

    // The distance at a time. Outside, what is farther than `enough` may be a bound, which costs less.
    Sample ask(const Vec3d& P, double time, double enough, std::int32_t hint = -1) const
    {
        const double t = part_of(time);
        // The surface was, or will be, at most its way elsewhere.
        double least = end_->sampler().distance(P) - fastest_ * (duration_ - time);
        if (begin_) least = std::max(least, begin_->sampler().distance(P) - fastest_ * time);
        if (least > enough) return {least, Vec3d::Zero()};

        const MovingTriangles::Place place = faces_.nearest(P, t, hint);
        Sample sample{0, Vec3d::Zero(), place.triangle, faces_.velocity(place, t) / duration_};
        const Eigen::Matrix3d now = faces_.frame(place.triangle, t);
        const Seen at_end = see(*end_, place, P, now, t, 1);
        Seen at_begin;
        if (begin_) at_begin = see(*begin_, place, P, now, t, 0);

        double weight = 0;
        const auto take = [&](const Seen& seen, double w) {
            if (!seen.agrees || w == 0) return;
            sample.phi += w * seen.phi;
            sample.gradient += w * seen.gradient;
            weight += w;
        };
        take(at_end, begin_ ? t : 1);
        take(at_begin, 1 - t);
        if (weight > 0) {
            sample.phi /= weight;
            sample.gradient /= weight;
        } else {
            // At both ends other parts of the body are nearer: the face alone says which side this is.
            const double side = (P - place.P).dot(now.col(2)) < 0 ? -1 : 1;
            sample.phi = side * place.distance;
        }
        if (sample.gradient.isZero(0))
            sample.gradient = place.distance > 0 ? Vec3d(std::copysign(1 / place.distance, sample.phi) * (P - place.P))
                                                 : Vec3d(now.col(2));
        return sample;
    }

    // What a level set says of a place, seen from the nearest face where that is then.
    struct Seen {
        double phi = 0;
        Vec3d gradient = Vec3d::Zero();  // as turned to now
        bool agrees = false;             // no other part of the body is nearer
    };
    Seen see(const GridLevelSet& level_set, const MovingTriangles::Place& place, const Vec3d& P,
             const Eigen::Matrix3d& now, double t, double then) const
    {
        Vec3d X = P;
        Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
        if (t != then) {
            turn = faces_.frame(place.triangle, then) * now.transpose();
            if (turn.isZero(0)) turn.setIdentity();
            X = faces_.at(place, then) + turn * (P - place.P);
        }
        Seen seen;
        seen.phi = level_set.sampler().distance(X, seen.gradient);
        seen.gradient = turn.transpose() * seen.gradient;
        const double band = level_set.band();
        seen.agrees = std::abs(seen.phi) >= std::min(place.distance, band) - level_set.voxel();
        // Beyond the band the faces know better.
        if (seen.gradient.isZero(0)) seen.phi = std::copysign(std::max(band, place.distance), seen.phi);
        return seen;
    }

    Contact first_contact(const Path& path) const
    {
        Contact contact;
        const double r = path.radius, feature = smallest_feature();
        Sample here = ask(path.P, path.begin, r + 2 * feature);
        double f = here.phi - r;
        const double near = flush_within(path.P, r, rounding_);
        if (f < -near) {
            const double slope = here.gradient.norm();
            contact.time = 0;
            contact.n = detail::unit_normal(here.gradient, path.v - here.vc);
            contact.vc = here.vc;
            contact.depth = slope > 0 ? -f / slope : -f;
            return contact;
        }
        // As in first_contact.h: a point that rounding left a little below goes by the level that it is on.
        const double level = r + std::min(f, 0.0);
        f = std::max(f, 0.0);
        double s = 0;
        if (f <= near) {
            const Vec3d relative = path.v - here.vc;
            const double slope = here.gradient.dot(relative);
            if (slope < 0 && !is_along(slope, relative)) return meet(path, 0, here.near);
            // It leaves, or is pressed to the surface.
            const double acceleration = path.a.norm() + curved_;
            double hop = Contact::none;
            if (acceleration > 0) hop = 2 * std::sqrt(2 * near / acceleration);
            if (slope > 0) hop = std::min(hop, 2 * near / slope);
            if (hop < Contact::none) {
                const double speed = relative.norm();
                if (hop * speed > feature / 4) hop = feature / (4 * speed);
                hop = std::min(hop, path.duration);
                const Sample there = ask(place(path, hop), path.begin + hop, r + 2 * feature, here.near);
                if (there.phi < level) return meet(path, 0, here.near, hop);
                s = hop, f = there.phi - level, here = there;
            }
        }

        while (s < path.duration) {
            const double next = std::min(path.duration, s + step(path, s, f, here));
            if (!(next > s)) return meet(path, s, here.near);  // below the rounding of the time: as good as there
            const Sample there = ask(place(path, next), path.begin + next, level + feature, here.near);
            if (there.phi < level) {
                const auto height = [&](double at) {
                    return ask(place(path, at), path.begin + at, level + feature, there.near).phi - level;
                };
                const double close = std::max(0x1p-50 * (path.P.cwiseAbs().maxCoeff() + r), rounding_ / 16);
                const double speed = (path.v + s * path.a).norm() + path.duration * path.a.norm() + fastest_;
                const double met = last_outside(height, s, f, next, there.phi - level, speed, close);
                return meet(path, met, there.near, met + 0x1p-8 * (next - s));
            }
            s = next, f = there.phi - level, here = there;
        }
        return contact;
    }

    // s that the path can go without reaching the surface, or a quarter of a voxel of the way that it goes along the
    // nearest part of it; but no farther than a voxel where another part may come.
    double step(const Path& path, double s, double f, const Sample& here) const
    {
        const double fastest =
            std::max((path.v + s * path.a).norm(), (path.v + path.duration * path.a).norm()) + fastest_;
        if (!(fastest > 0)) return path.duration;
        const double free = f / (slope_bound() * fastest), voxel = end_->voxel();
        if (here.near < 0) return free;
        const Vec3d relative = path.v + s * path.a - here.vc;
        const double beside = detail::time_to_travel(voxel / 4, relative.norm(), path.a.norm() + curved_);
        return std::max(free, std::min(beside, voxel / fastest));
    }

    // The contact of a path that is on the surface at time s. soon: s, a time after it, as in first_contact.h.
    Contact meet(const Path& path, double s, std::int32_t hint, double soon = 0) const
    {
        Contact contact;
        contact.time = s;
        const Vec3d P = place(path, s), v = path.v + s * path.a;
        const Sample here = ask(P, path.begin + s, path.radius + band(), hint);
        contact.vc = here.vc;
        Vec3d gradient = here.gradient;
        if (soon > s && gradient.dot(v - here.vc) >= 0) {
            const Sample beyond = ask(place(path, soon), path.begin + soon, path.radius + band(), hint);
            if (beyond.gradient.dot(path.v + soon * path.a - beyond.vc) < 0) gradient = beyond.gradient;
        }
        const Vec3d n = contact.n = detail::unit_normal(gradient, v - here.vc);
        const Vec3d tangent = v - here.vc - n.dot(v - here.vc) * n;
        const double speed = tangent.norm(), way = end_->voxel() / 2;
        if (!(speed > 0)) return contact;
        const Sample ahead = ask(P + way / speed * tangent, path.begin + s, path.radius + band(), here.near);
        const double size = ahead.gradient.norm();
        if (size > 0) contact.curvature = tangent.dot(ahead.gradient / size - n) / (speed * way);
        return contact;
    }

    GridPtr begin_, end_;
    MovingTriangles faces_;
    double duration_;          // s
    double fastest_, curved_;  // of the faces: m/s, m/s²
    double rounding_;          // of a distance, m
    Box3d bounds_;
};

std::shared_ptr<const TriangleTree> tree_of(const MeshPtr& mesh) { return std::make_shared<TriangleTree>(mesh); }

ShapePtr between(const LevelSetPtr& begin, const LevelSetPtr& end, const std::shared_ptr<const TriangleTree>& tree,
                 std::vector<Cubic<Vec3d>> ways, double duration)
{
    return std::make_shared<DeformingShape>(std::static_pointer_cast<const GridLevelSet>(begin),
                                            std::static_pointer_cast<const GridLevelSet>(end),
                                            MovingTriangles(tree, std::move(ways)), duration);
}

const bool defined = triangle_tree.define(tree_of) && deforming_shape.define(between);

}  // namespace
}  // namespace rapid

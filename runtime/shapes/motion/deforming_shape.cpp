#include "runtime/shapes/motion/deforming_shape.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/motion/moving_body.h"
#include "runtime/shapes/motion/moving_contact.h"
#include "runtime/shapes/motion/moving_triangles.h"

namespace rapid {
namespace {

using BakedPtr = std::shared_ptr<const BakedLevelSet>;

// Returns the acceleration of a point fixed to a face, as a difference of velocities; m per interval². The velocities
// are polynomials of second degree, apart from the turning normal.
Vec3d by_difference(const MovingTriangles& faces, const MaterialPoint& point, double t)
{
    constexpr double step = 0x1p-10;
    return (faces.velocity(point.face, point.at, t + step) - faces.velocity(point.face, point.at, t - step)) /
           (2 * step);
}

// The distance from a surface that moves from one level set to the next along the curves of its vertices.
class DeformingDistance {
public:
    // begin: null if the interval begins with a jump; the end's level set is then carried back along the curves.
    DeformingDistance(BakedPtr begin, BakedPtr end, MovingTriangles faces, double duration)
        : begin_(std::move(begin)),
          end_(std::move(end)),
          faces_(std::move(faces)),
          duration_(duration),
          fastest_(faces_.fastest() / duration),
          most_curved_(faces_.most_curved() / (duration * duration))
    {
    }

    struct Sample {
        double phi;
        Vec3d gradient;             // length about 1; zero outside if phi is only a bound
        std::int32_t nearest = -1;  // triangle, if one was searched for
        Vec3d vc = Vec3d::Zero();   // velocity of the surface, m/s
    };

    // Samples at a time. Outside, a distance above `exact` may be a cheaper bound. hint: a nearby triangle.
    Sample at(const Vec3d& P, double time, double exact, std::int32_t hint = -1) const
    {
        const double t = part_of(time);
        // The surface at either end differs from that at `time` by at most its speed times the time in between.
        double least = end_->sampler().distance(P) - fastest_ * (duration_ - time);
        if (begin_) least = std::max(least, begin_->sampler().distance(P) - fastest_ * time);
        if (least > exact) return {least, Vec3d::Zero()};

        const MovingTriangles::SurfacePoint surface_point = faces_.nearest(P, t, hint);
        Sample sample{0, Vec3d::Zero(), surface_point.triangle, faces_.velocity(surface_point, t) / duration_};
        const Eigen::Matrix3d now = faces_.frame(surface_point.triangle, t);
        const EndSample at_end = sample_end(*end_, surface_point, P, now, t, 1);
        EndSample at_begin;
        if (begin_) at_begin = sample_end(*begin_, surface_point, P, now, t, 0);

        double weight = 0;
        const auto add = [&](const EndSample& end, double w) {
            if (!end.agrees || w == 0) return;
            sample.phi += w * end.phi;
            sample.gradient += w * end.gradient;
            weight += w;
        };
        add(at_end, begin_ ? t : 1);
        add(at_begin, 1 - t);
        if (weight > 0) {
            sample.phi /= weight;
            sample.gradient /= weight;
        } else {
            // At both ends other parts of the body are nearer, so only the face decides the side.
            const double side = (P - surface_point.P).dot(now.col(2)) < 0 ? -1 : 1;
            sample.phi = side * surface_point.distance;
        }
        if (sample.gradient.isZero(0))
            sample.gradient = surface_point.distance > 0
                                  ? Vec3d(std::copysign(1 / surface_point.distance, sample.phi) * (P - surface_point.P))
                                  : Vec3d(now.col(2));
        return sample;
    }

    Vec3d velocity(const Vec3d& P, double time) const
    {
        const double t = part_of(time);
        return faces_.velocity(faces_.nearest(P, t), t) / duration_;
    }

    // Returns the motion of a point fixed to a face.
    MovingBody::State follow(const MaterialPoint& point, double time) const
    {
        const double t = part_of(time);
        return {faces_.at(point.face, point.at, t), faces_.velocity(point.face, point.at, t) / duration_,
                acceleration(point, t)};
    }
    Vec3d acceleration(const Vec3d& P, const Vec3d& v, double time) const
    {
        const double t = part_of(time);
        const MaterialPoint point = material(P, time);
        const Vec3d slip = v - faces_.velocity(point.face, point.at, t) / duration_;
        return acceleration(point, t) + 2 / duration_ * faces_.turning(point.face, slip, t);
    }
    MaterialPoint material(const Vec3d& P, double time) const
    {
        const double t = part_of(time);
        const std::int32_t face = faces_.nearest(P, t).triangle;
        return {face, faces_.coordinates(face, P, t)};
    }
    bool has(const MaterialPoint& point) const
    {
        return point.face >= 0 && static_cast<std::size_t>(point.face) < faces_.triangles();
    }

    const BakedLevelSet& end() const { return *end_; }
    double band() const { return begin_ ? std::min(begin_->band(), end_->band()) : end_->band(); }
    double slope_bound() const
    {
        return begin_ ? std::max(begin_->slope_bound(), end_->slope_bound()) : end_->slope_bound();
    }
    double voxel() const { return end_->voxel(); }
    double rounding() const { return 0x1p-21 * end_->band(); }  // m
    double fastest() const { return fastest_; }                 // bound on the faces' speed, m/s
    double most_curved() const { return most_curved_; }         // bound on the faces' acceleration, m/s²
    Box3d bounds() const
    {
        const Vec3d margin = Vec3d::Constant(voxel());
        return {faces_.bounds().min() - margin, faces_.bounds().max() + margin};
    }

private:
    Vec3d acceleration(const MaterialPoint& point, double t) const
    {
        return by_difference(faces_, point, t) / (duration_ * duration_);
    }

    double part_of(double time) const { return std::clamp(time / duration_, 0.0, 1.0); }

    // A sample of the level set at one end of the interval, at the position that P then has in the frame of its nearest
    // face.
    struct EndSample {
        double phi = 0;
        Vec3d gradient = Vec3d::Zero();  // rotated to the current orientation
        bool agrees = false;             // no other part of the body is nearer
    };
    EndSample sample_end(const BakedLevelSet& level_set, const MovingTriangles::SurfacePoint& surface_point,
                         const Vec3d& P, const Eigen::Matrix3d& now, double t, double then) const
    {
        Vec3d X = P;
        Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
        if (t != then) {
            turn = faces_.frame(surface_point.triangle, then) * now.transpose();
            if (turn.isZero(0)) turn.setIdentity();
            X = faces_.at(surface_point, then) + turn * (P - surface_point.P);
        }
        EndSample sample;
        sample.phi = level_set.sampler().distance(X, sample.gradient);
        sample.gradient = turn.transpose() * sample.gradient;
        const double band = level_set.band();
        sample.agrees = std::abs(sample.phi) >= std::min(surface_point.distance, band) - level_set.voxel();
        // Beyond the band the distance to the face is more accurate.
        if (sample.gradient.isZero(0)) sample.phi = std::copysign(std::max(band, surface_point.distance), sample.phi);
        return sample;
    }

    BakedPtr begin_, end_;
    MovingTriangles faces_;
    double duration_;               // s
    double fastest_, most_curved_;  // bounds for the faces: m/s, m/s²
};

// Adapts DeformingDistance to ContactWalk, as seen from one path.
struct DeformingField {
    using Hint = std::int32_t;  // nearest triangle
    struct Sample {
        double height;
        Vec3d X, gradient, velocity, vc;
        double slope;
        Hint hint;
        static constexpr double scale = 1;
    };
    static constexpr double kink = 0x1p-8;

    const DeformingDistance& body;
    const Path& path;
    double level;  // m

    double exact_within(Exact exact) const
    {
        switch (exact) {
            case Exact::InStep:
                return level + body.voxel();
            case Exact::AtStart:
                return path.radius + 2 * body.voxel();
            case Exact::InBand:
                break;
        }
        return path.radius + body.band();
    }

    Sample sample(double s, double height, const DeformingDistance::Sample& there) const
    {
        Sample sample{height, path.at(s), there.gradient, path.velocity(s) - there.vc, there.vc, 0, there.nearest};
        sample.slope = sample.gradient.dot(sample.velocity);
        return sample;
    }
    Sample at(double s, Hint hint, Exact exact) const
    {
        const auto there = body.at(path.at(s), path.begin + s, exact_within(exact), hint);
        return sample(s, there.phi - level, there);
    }
    double height(double s, Hint hint) const
    {
        return body.at(path.at(s), path.begin + s, exact_within(Exact::InStep), hint).phi - level;
    }
    Vec3d gradient_at(const Vec3d& X, double s, const Sample& here) const
    {
        return body.at(X, path.begin + s, exact_within(Exact::InBand), here.hint).gradient;
    }
    Contact contact(double s, const Vec3d& n, const Sample& here) const
    {
        Contact contact;
        contact.time = s;
        contact.n = n;
        contact.vc = here.vc;
        return contact;
    }

    // Returns a step that is free of the surface. If a quarter of a voxel of travel relative to the nearest part takes
    // longer, it returns that, limited to one voxel of closing distance because another part may approach.
    double step(double s, const Sample& here) const
    {
        const double fastest = std::max(path.velocity(s).norm(), path.velocity(path.duration).norm()) + body.fastest();
        if (!(fastest > 0)) return path.duration;
        const double free = here.height / (body.slope_bound() * fastest), voxel = body.voxel();
        if (here.hint < 0) return free;
        const double beside = time_to_travel(voxel / 4, here.velocity.norm(), acceleration());
        return std::max(free, std::min(beside, voxel / fastest));
    }
    double hop(const Sample&) const { return 0; }
    double fastest(double s, const Sample&, double) const
    {
        return path.velocity(s).norm() + path.duration * path.a.norm() + body.fastest();
    }
    double approach_speed(const Sample& ahead, const Sample&) const { return ahead.gradient.dot(ahead.velocity); }
    double acceleration() const { return path.a.norm() + body.most_curved(); }
    double close(const Sample&) const { return touching_within(path, body.rounding()); }
    double smallest_feature() const { return body.voxel(); }
    Box3d bounds() const { return body.bounds(); }
    bool open_ended() const { return false; }
};

class DeformingShape final : public MovingBody {
public:
    explicit DeformingShape(DeformingDistance body) : body_(std::move(body)), bounds_(body_.bounds()) {}

    std::string_view kind() const override { return "level set"; }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return body_.band(); }
    double slope_bound() const override { return body_.slope_bound(); }
    double smallest_feature() const override { return body_.voxel(); }
    bool moves() const override { return true; }
    MeshPtr surface() const override { return body_.end().surface(); }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        body_.end().distance(P, phi, gradient);
    }

    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) {
            const auto sample = body_.at(P[i], time[i], band());
            phi[i] = sample.phi;
            if (!gradient.empty()) gradient[i] = sample.gradient;
        }
    }

    Vec3d velocity_at(const Vec3d& P, double time) const override { return body_.velocity(P, time); }
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        return body_.acceleration(P, v, time);
    }
    MaterialPoint material_at(const Vec3d& P, double time) const override { return body_.material(P, time); }
    bool has(const MaterialPoint& point) const override { return body_.has(point); }
    State follow(const MaterialPoint& point, double time) const override { return body_.follow(point, time); }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        for (std::size_t i = 0; i < paths.size(); ++i)
            contacts[i] = may_reach(paths[i], bounds_) ? first_contact_of<DeformingField>(body_, paths[i]) : Contact();
    }

private:
    DeformingDistance body_;
    Box3d bounds_;
};

// The surface of a mesh without an inside.
class DeformingSurface final : public MovingBody {
public:
    DeformingSurface(MovingTriangles faces, double duration) : faces_(std::move(faces)), duration_(duration) {}

    std::string_view kind() const override { return "mesh"; }
    Box3d bounds() const override { return faces_.bounds(); }
    bool moves() const override { return faces_.fastest() > 0; }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, duration_, phi, gradient);
    }
    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        for (std::size_t i = 0; i < P.size(); ++i) sample(i, P, time[i], phi, gradient);
    }

    Vec3d velocity_at(const Vec3d& P, double time) const override
    {
        const double t = part_of(time);
        return faces_.velocity(faces_.nearest(P, t), t) / duration_;
    }
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        const double t = part_of(time);
        const MaterialPoint point = material_at(P, time);
        const Vec3d slip = v - faces_.velocity(point.face, point.at, t) / duration_;
        return acceleration(point, t) + 2 / duration_ * faces_.turning(point.face, slip, t);
    }
    MaterialPoint material_at(const Vec3d& P, double time) const override
    {
        const double t = part_of(time);
        const std::int32_t face = faces_.nearest(P, t).triangle;
        return {face, faces_.coordinates(face, P, t)};
    }
    bool has(const MaterialPoint& point) const override
    {
        return point.face >= 0 && static_cast<std::size_t>(point.face) < faces_.triangles();
    }
    State follow(const MaterialPoint& point, double time) const override
    {
        const double t = part_of(time);
        return {faces_.at(point.face, point.at, t), faces_.velocity(point.face, point.at, t) / duration_,
                acceleration(point, t)};
    }

    // Finds no contacts, because there is no inside.
    void first_contact(std::span<const Path>, std::span<Contact> contacts) const override
    {
        std::fill(contacts.begin(), contacts.end(), Contact());
    }

private:
    double part_of(double time) const { return std::clamp(time / duration_, 0.0, 1.0); }

    // Computes the distance and the gradient. On the surface itself the gradient is the normal of the face.
    void sample(std::size_t i, std::span<const Vec3d> P, double time, std::span<double> phi,
                std::span<Vec3d> gradient) const
    {
        const double t = part_of(time);
        const MovingTriangles::SurfacePoint surface_point = faces_.nearest(P[i], t);
        phi[i] = surface_point.distance;
        if (gradient.empty()) return;
        if (surface_point.distance > 0)
            gradient[i] = (P[i] - surface_point.P) / surface_point.distance;
        else
            gradient[i] = faces_.frame(surface_point.triangle, t).col(2);
    }
    Vec3d acceleration(const MaterialPoint& point, double t) const
    {
        return by_difference(faces_, point, t) / (duration_ * duration_);
    }

    MovingTriangles faces_;
    double duration_;  // s
};

}  // namespace

std::shared_ptr<const TriangleTree> triangle_tree(const MeshPtr& mesh)
{
    static std::mutex mutex;
    static std::map<std::weak_ptr<const Mesh>, std::weak_ptr<const TriangleTree>, std::owner_less<>> known;
    const std::lock_guard lock(mutex);
    std::erase_if(known, [](const auto& entry) { return entry.second.expired(); });
    std::shared_ptr<const TriangleTree> tree = known[mesh].lock();
    if (!tree) known[mesh] = tree = std::make_shared<TriangleTree>(mesh);
    return tree;
}

std::shared_ptr<const MovingBody> deforming_surface(const std::shared_ptr<const TriangleTree>& tree,
                                                    std::vector<Cubic<Vec3d>> curves, double duration)
{
    return std::make_shared<DeformingSurface>(MovingTriangles(tree, std::move(curves)), duration);
}

ShapePtr deforming_shape(const LevelSetPtr& begin, const LevelSetPtr& end,
                         const std::shared_ptr<const TriangleTree>& tree, std::vector<Cubic<Vec3d>> curves,
                         double duration)
{
    return std::make_shared<DeformingShape>(DeformingDistance(std::static_pointer_cast<const BakedLevelSet>(begin),
                                                              std::static_pointer_cast<const BakedLevelSet>(end),
                                                              MovingTriangles(tree, std::move(curves)), duration));
}

}  // namespace rapid

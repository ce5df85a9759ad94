#include "runtime/shapes/motion/moving.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/moving_body.h"
#include "runtime/shapes/motion/rigid_contacts.h"

namespace rapid {
namespace {

using Piece = MotionTrack::Piece;

class MovingShape final : public MovingBody {
public:
    MovingShape(ShapePtr rest, MotionTrack track) : rest_(std::move(rest)), track_(std::move(track))
    {
        for (const Piece& piece : track_.pieces()) bounds_.extend(swept(piece));
    }

    std::string_view kind() const override { return rest_.shape->kind(); }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return min_scale() * rest_.shape->band(); }
    double slope_bound() const override { return rest_.shape->slope_bound(); }
    double smallest_feature() const override { return min_scale() * rest_.shape->smallest_feature(); }

    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        const std::vector<double> time(P.size(), track_.duration());
        distance_at(P, time, phi, gradient);
    }

    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        if (P.empty()) return;
        std::vector<Vec3d> X(P.size());
        std::vector<Pose> poses;  // one per point, or a single one if all have the same time
        const bool at_once = std::all_of(time.begin(), time.end(), [&](double t) { return t == time.front(); });
        const std::size_t each = at_once ? 0 : 1;
        for (std::size_t i = 0; i < (at_once ? 1 : P.size()); ++i) poses.push_back(track_.at(time[i]));
        for (std::size_t i = 0; i < P.size(); ++i) X[i] = poses[each * i].inverse() * P[i];
        rest_.shape->distance(X, phi, gradient);
        for (std::size_t i = 0; i < P.size(); ++i) phi[i] *= poses[each * i].scale;
        for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] = poses[each * i].rotation * gradient[i];
    }

    bool moves() const override { return true; }
    Vec3d velocity_at(const Vec3d& P, double time) const override { return track_.velocity_at(time).at(P); }
    // Differentiates x = T + k R X with constant X': centripetal, Coriolis and growth terms.
    Vec3d acceleration_at(const Vec3d& P, const Vec3d& v, double time) const override
    {
        const Piece& piece = track_.piece_at(time);
        if (piece.only_translates()) return piece.a;
        const Pose pose = piece.at(time);
        const Vec3d arm = P - pose.translation, slip = v - piece.velocity_at(time).at(P);
        const double growth = piece.growth / pose.scale;
        const Vec3d turned = piece.spin.cross(arm);
        return piece.a + piece.spin.cross(turned) + 2 * growth * turned + 2 * (piece.spin.cross(slip) + growth * slip);
    }

    MaterialPoint material_at(const Vec3d& P, double time) const override
    {
        return {MaterialPoint::rigid, track_.at(time).inverse() * P};
    }
    bool has(const MaterialPoint& point) const override { return point.face == MaterialPoint::rigid; }
    State follow(const MaterialPoint& point, double time) const override
    {
        const Vec3d P = track_.at(time) * point.at, v = velocity_at(P, time);
        return {P, v, acceleration_at(P, v, time) + euler_acceleration(P, time)};
    }

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        std::fill(contacts.begin(), contacts.end(), Contact());
        std::vector<std::size_t> open;
        for (std::size_t i = 0; i < paths.size(); ++i)
            if (may_reach(paths[i], bounds_)) open.push_back(i);
        const std::span<const Piece> pieces = track_.pieces();
        for (std::size_t k = 0; k < pieces.size() && !open.empty(); ++k) {
            // Paths that begin before the interval or end after it use its first or last piece.
            const bool first = k == 0, last = k + 1 == pieces.size();
            RigidContacts in_piece(rest_, pieces[k], paths, contacts);
            for (const std::size_t i : open) {
                const Path& path = paths[i];
                const double from = first ? 0 : std::max(0.0, pieces[k].begin - path.begin);
                const double to = last ? path.duration : std::min(path.duration, pieces[k].end - path.begin);
                if (from < to || (from == to && from == 0)) in_piece.add(i, from, to);
            }
            in_piece.find();
            std::erase_if(open, [&](std::size_t i) { return contacts[i].time != Contact::none; });
        }
    }

    // Returns the surface at the end.
    MeshPtr surface() const override { return placed(rest_.shape, track_.at(track_.duration()))->surface(); }

private:
    // Returns the contribution of a changing spin to the acceleration of a body's point. Each piece of the track has a
    // constant spin, and the spin at a time is interpolated between the middles of the pieces.
    Vec3d euler_acceleration(const Vec3d& P, double time) const
    {
        const std::span<const Piece> pieces = track_.pieces();
        const Piece& piece = track_.piece_at(time);
        const auto k = static_cast<std::size_t>(&piece - pieces.data());
        const Piece &before = pieces[k > 0 ? k - 1 : k], &after = pieces[std::min(k + 1, pieces.size() - 1)];
        const auto middle = [](const Piece& one) { return 0.5 * (one.begin + one.end); };
        if (!(middle(after) > middle(before))) return Vec3d::Zero();
        const Vec3d rate = (after.spin - before.spin) / (middle(after) - middle(before));
        const Vec3d arm = P - piece.at(time).translation, spin = piece.spin + (time - middle(piece)) * rate;
        return rate.cross(arm) + spin.cross(spin.cross(arm)) - piece.spin.cross(piece.spin.cross(arm));
    }

    double min_scale() const
    {
        double least = track_.at(track_.duration()).scale;
        for (const Piece& piece : track_.pieces()) least = std::min(least, piece.pose.scale);
        return least;
    }

    // Returns the box that the rest shape's box sweeps during a piece.
    Box3d swept(const Piece& piece) const
    {
        const Box3d rest = rest_.shape->bounds();
        const double T = piece.end - piece.begin;
        const Pose begin = piece.at(piece.begin), end = piece.at(piece.end);
        Box3d box = moved(begin, rest);
        box.extend(moved(end, rest));
        if (box.isEmpty()) return box;
        double arm = 0;  // distance of the farthest corner, m
        for (int k = 0; k < 8; ++k) arm = std::max(arm, rest.corner(static_cast<Box3d::CornerType>(k)).norm());
        const double turn = piece.spin.norm() * T;
        // The sagitta of an arc, 1 - cos(turn / 2). It is 0 for a body that does not turn, which may be infinite.
        const double sine = std::sin(std::min<double>(turn, 2 * EIGEN_PI) / 4);
        const double grown = std::abs(end.scale - begin.scale);
        const double arc = turn > 0 ? arm * (std::max(begin.scale, end.scale) * 2 * sine * sine + grown) : 0;
        const Vec3d margin = Vec3d::Constant(piece.a.norm() * T * T / 8 + arc);
        return {box.min() - margin, box.max() + margin};
    }

    RestShape rest_;
    MotionTrack track_;
    Box3d bounds_;
};

}  // namespace

ShapePtr moving(const ShapePtr& rest, const Motion& motion, const FrameClock& clock, double from, double to)
{
    return std::make_shared<MovingShape>(rest, MotionTrack(motion, clock, from, to));
}

MovingStep moving_in_step(const AnimatedShape& shape, const FrameClock& clock, std::int64_t step,
                          const PathOptions& options)
{
    const FramePath path = path_of(shape, clock, step, options);
    const double from = clock.at_step(step - 1).number, to = clock.at_step(step).number;
    const MotionPtr motion =
        path.kind == FramePath::AfterCut ? going_back(shape.motion(), clock, to, path.after) : shape.motion();
    return {moving(shape.rest(), *motion, clock, from, to), path.jump};
}

}  // namespace rapid

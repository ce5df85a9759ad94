#include "runtime/shapes/motion/moving.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/last_outside.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {
namespace {

using Piece = MotionTrack::Piece;

// A path as it is seen from the shape, within one piece of its motion. Rest units: metres of the rest shape.
class Seen {
public:
    // Between two times of the path.
    Seen(const Piece& piece, const Path& path, double first, double last) : piece_(&piece), path_(&path)
    {
        const double T = last - first;
        const Frame begin = frame_at(first), end = frame_at(last);
        const double k = std::min(begin.scale, end.scale), growth = std::abs(piece.growth) / k;
        const double turning = piece.spin.norm(), a = (path.a - piece.a).norm();
        // The relative velocity is linear in time, so its size is largest at an end; the way between is off its chord
        // by a T²/8 at most.
        const double speed = std::max(begin.relative_velocity.norm(), end.relative_velocity.norm());
        const double sag = a * T * T / 8, arm = std::max(begin.arm.norm(), end.arm.norm()) + sag;
        // From the axis: of what lies along it nothing turns.
        const auto lever = [&](const Vec3d& x) { return x.cross(piece.spin).norm(); };
        const double turned = turning > 0 ? std::max(lever(begin.arm), lever(end.arm)) + turning * sag : 0;
        acceleration_ =
            (a + 2 * turning * speed + turning * turned + 2 * growth * (speed + turned) + 2 * growth * growth * arm) /
            k;
        level_speed_ = std::abs(piece.growth) / (k * k);
        level_acceleration_ = 2 * growth * growth / k;
    }

    struct Place {
        Vec3d X, velocity;  // rest units, and a second
        double scale;       // m a rest unit
        Eigen::Quaterniond rotation;
        double level_rate;  // 1/s: by how much 1/scale falls
    };
    Place at(double s) const
    {
        const Frame f = frame_at(s);
        const Eigen::Quaterniond back = f.rotation.conjugate();
        const Vec3d slip = f.relative_velocity - piece_->spin.cross(f.arm) - piece_->growth / f.scale * f.arm;
        return {back * f.arm / f.scale, back * slip / f.scale, f.scale, f.rotation,
                piece_->growth / (f.scale * f.scale)};
    }
    Vec3d world(double s) const { return place(*path_, s); }
    // Of the surface where the path is.
    Vec3d surface_velocity(double s) const { return piece_->velocity_at(path_->begin + s).at(world(s)); }

    // At most, over the way; of a path that keeps a level above 0, of its distance from that level.
    double acceleration(double level) const { return acceleration_ + std::abs(level) * level_acceleration_; }
    double speed_beside(double level) const { return std::abs(level) * level_speed_; }

private:
    struct Frame {
        Vec3d arm, relative_velocity;  // from and to the origin of the shape's frame, in the world
        Eigen::Quaterniond rotation;
        double scale;
    };
    Frame frame_at(double s) const
    {
        const double t = path_->begin + s;
        const Pose pose = piece_->at(t);
        return {world(s) - pose.translation, path_->v + s * path_->a - (piece_->v + (t - piece_->begin) * piece_->a),
                pose.rotation, pose.scale};
    }

    const Piece* piece_;
    const Path* path_;
    double acceleration_, level_speed_, level_acceleration_;
};

// One path within one piece, on its way from `s` to `end`, where it is f (rest units) above its level.
struct Walker {
    std::size_t path;
    Seen seen;
    double s, end;
    double level;  // m
    double f;      // rest units
    double slope;  // of f in time
    int steps = 0;
};

class MovingShape final : public RigidBody {
public:
    MovingShape(ShapePtr rest, MotionTrack track)
        : rest_(std::move(rest)),
          track_(std::move(track)),
          convex_(!(rest_->smallest_feature() > 0)),
          rounding_(std::isfinite(rest_->band()) ? 0x1p-21 * rest_->band() : 0)
    {
        for (const Piece& piece : track_.pieces()) bounds_.extend(swept(piece));
    }

    std::string_view kind() const override { return rest_->kind(); }
    Box3d bounds() const override { return bounds_; }
    double band() const override { return least_scale() * rest_->band(); }
    double slope_bound() const override { return rest_->slope_bound(); }
    double smallest_feature() const override { return least_scale() * rest_->smallest_feature(); }

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
        std::vector<Pose> poses;  // of each point; one where all are asked at one time
        const bool at_once = std::all_of(time.begin(), time.end(), [&](double t) { return t == time.front(); });
        const std::size_t each = at_once ? 0 : 1;
        for (std::size_t i = 0; i < (at_once ? 1 : P.size()); ++i) poses.push_back(track_.at(time[i]));
        for (std::size_t i = 0; i < P.size(); ++i) X[i] = poses[each * i].inverse() * P[i];
        rest_->distance(X, phi, gradient);
        for (std::size_t i = 0; i < P.size(); ++i) phi[i] *= poses[each * i].scale;
        for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] = poses[each * i].rotation * gradient[i];
    }

    bool moves() const override { return true; }
    Vec3d velocity_at(const Vec3d& P, double time) const override { return track_.velocity_at(time).at(P); }
    // Of x = T + k R X with X' constant: centripetal, Coriolis', and their kin by growth.
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

    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        std::fill(contacts.begin(), contacts.end(), Contact());
        std::vector<std::size_t> open;
        for (std::size_t i = 0; i < paths.size(); ++i)
            if (may_reach(paths[i], bounds_)) open.push_back(i);
        const std::span<const Piece> pieces = track_.pieces();
        for (std::size_t k = 0; k < pieces.size() && !open.empty(); ++k) {
            // What begins before the interval, or ends after it, goes by its first and last piece.
            const bool first = k == 0, last = k + 1 == pieces.size();
            std::vector<Walker> walkers;
            for (const std::size_t i : open) {
                const Path& path = paths[i];
                const double from = first ? 0 : std::max(0.0, pieces[k].begin - path.begin);
                const double to = last ? path.duration : std::min(path.duration, pieces[k].end - path.begin);
                if (from < to || (from == to && from == 0))
                    walkers.push_back({i, Seen(pieces[k], path, from, to), from, to, path.radius, 0, 0});
            }
            set_out(walkers, paths, contacts);
            if (pieces[k].only_translates())
                fly_straight(pieces[k], walkers, paths, contacts);
            else
                walk(walkers, paths, contacts);
            std::erase_if(open, [&](std::size_t i) { return contacts[i].time != Contact::none; });
        }
    }

    // As it is at the end.
    MeshPtr surface() const override { return placed(rest_, track_.at(track_.duration()))->surface(); }

private:
    double least_scale() const
    {
        double least = track_.at(track_.duration()).scale;
        for (const Piece& piece : track_.pieces()) least = std::min(least, piece.pose.scale);
        return least;
    }

    // Where the box of the rest shape comes in a piece.
    Box3d swept(const Piece& piece) const
    {
        const Box3d rest = rest_->bounds();
        const double T = piece.end - piece.begin;
        const Pose begin = piece.at(piece.begin), end = piece.at(piece.end);
        Box3d box = moved(begin, rest);
        box.extend(moved(end, rest));
        if (box.isEmpty()) return box;
        double arm = 0;  // of the farthest corner, m
        for (int k = 0; k < 8; ++k) arm = std::max(arm, rest.corner(static_cast<Box3d::CornerType>(k)).norm());
        const double turn = piece.spin.norm() * T;
        // Of an arc over its chord, 1 - cos(turn / 2); none of a body that does not turn, which may be infinite.
        const double sine = std::sin(std::min<double>(turn, 2 * EIGEN_PI) / 4);
        const double grown = std::abs(end.scale - begin.scale);
        const double arc = turn > 0 ? arm * (std::max(begin.scale, end.scale) * 2 * sine * sine + grown) : 0;
        const Vec3d margin = Vec3d::Constant(piece.a.norm() * T * T / 8 + arc);
        return {box.min() - margin, box.max() + margin};
    }

    void ask(std::span<const Vec3d> X, std::vector<double>& phi, std::vector<Vec3d>& gradient) const
    {
        phi.resize(X.size());
        gradient.resize(X.size());
        rest_->distance(X, phi, gradient);
    }
    double height(const Walker& w, double s, Vec3d& gradient) const
    {
        const Seen::Place there = w.seen.at(s);
        double phi = 0;
        rest_->distance({&there.X, 1}, {&phi, 1}, {&gradient, 1});
        return phi - w.level / there.scale;
    }

    static double flush(const Path& path, double rounding) { return flush_within(path.P, path.radius, rounding); }
    // How near counts as there, rest units.
    double close(const Path& path, double scale) const
    {
        return std::max(0x1p-50 * (path.P.cwiseAbs().maxCoeff() + path.radius) / scale, rounding_ / 16);
    }

    // The beginnings of the paths: contacts at once, and how high the others are. Keeps those that go on.
    void set_out(std::vector<Walker>& walkers, std::span<const Path> paths, std::span<Contact> contacts) const
    {
        std::vector<Vec3d> X, gradient;
        std::vector<double> phi;
        for (const Walker& w : walkers) X.push_back(w.seen.at(w.s).X);
        ask(X, phi, gradient);
        std::size_t kept = 0;
        for (std::size_t i = 0; i < walkers.size(); ++i) {
            Walker w = walkers[i];
            w.f = phi[i];
            if (sets_out(w, gradient[i], paths[w.path], contacts[w.path])) walkers[kept++] = w;
        }
        walkers.erase(walkers.begin() + static_cast<std::ptrdiff_t>(kept), walkers.end());
    }

    // w.f is the distance of the place where it begins, in rest units.
    bool sets_out(Walker& w, const Vec3d& gradient, const Path& path, Contact& contact) const
    {
        const Seen::Place there = w.seen.at(w.s);
        const double f = there.scale * w.f - path.radius, near = flush(path, there.scale * rounding_);
        if (w.s == 0 && f < -near) {
            inside(w, there, path, contact);
            return false;
        }
        w.level = path.radius + std::min(f, 0.0);
        w.f -= w.level / there.scale;
        w.slope = gradient.dot(there.velocity) + w.level * there.level_rate;
        if (f > near) return true;

        if (w.slope < 0 && !is_along(w.slope, there.velocity)) return meet(w, w.s, contact), false;
        // It leaves, or is pressed to the surface: as in first_contact.h.
        const double acceleration = w.seen.acceleration(w.level), lift = 2 * near / there.scale;
        const double feature = rest_->smallest_feature();
        double hop = Contact::none;
        if (acceleration > 0) hop = 2 * std::sqrt(lift / acceleration);
        if (feature > 0 && w.slope > 0) hop = std::min(hop, lift / w.slope);
        if (hop < Contact::none) {
            const double speed = there.velocity.norm();
            if (feature > 0 && hop * speed > feature / 4) hop = feature / (4 * speed);
            const double after = std::min(w.end, w.s + hop);
            Vec3d g;
            const double ahead = height(w, after, g);
            if (ahead < 0) return meet(w, w.s, contact, after), false;
            const Seen::Place then = w.seen.at(after);
            w.s = after, w.f = ahead, w.slope = g.dot(then.velocity) + w.level * then.level_rate;
        }
        return true;
    }

    // The rest shape says how to get out, of a path that goes as this one goes now.
    void inside(const Walker& w, const Seen::Place& there, const Path& path, Contact& contact) const
    {
        const Path now{there.X, there.velocity, Vec3d::Zero(), 0, path.radius / there.scale};
        rest_->first_contact({&now, 1}, {&contact, 1});
        // What is flush with the surface for its frame, where the shape rests farther from the origin than it is now.
        if (contact.time == Contact::none) return meet(w, 0, contact);
        contact.time = 0;
        contact.n = there.rotation * contact.n;
        contact.vc = w.seen.surface_velocity(0);
        contact.depth *= there.scale;
        contact.curvature /= there.scale;
    }

    // The contact of a path that is on the surface at time s. soon: s, a time after it, as in first_contact.h.
    void meet(const Walker& w, double s, Contact& contact, double soon = 0) const
    {
        const Seen::Place there = w.seen.at(s);
        Vec3d gradient;
        height(w, s, gradient);
        if (soon > s && gradient.dot(there.velocity) >= 0) {
            Vec3d beyond;
            height(w, soon, beyond);
            if (beyond.dot(w.seen.at(soon).velocity) < 0) gradient = beyond;
        }
        contact.time = s;
        const Vec3d n = detail::unit_normal(gradient, there.velocity);
        contact.n = there.rotation * n;
        contact.vc = w.seen.surface_velocity(s);
        const Vec3d tangent = there.velocity - n.dot(there.velocity) * n;
        const double speed = tangent.norm(), feature = rest_->smallest_feature();
        const double way = feature > 0 ? feature / 2 : 0x1p-20 * rest_->bounds().sizes().maxCoeff();
        if (!(speed > 0) || !std::isfinite(way)) return;
        const Vec3d X = there.X + way / speed * tangent;
        double phi = 0;
        Vec3d ahead;
        rest_->distance({&X, 1}, {&phi, 1}, {&ahead, 1});
        if (ahead.norm() > 0) contact.curvature = tangent.dot(ahead.normalized() - n) / (speed * way * there.scale);
    }

    // A parabola in the world is one in a frame that only moves along.
    void fly_straight(const Piece& piece, std::span<const Walker> walkers, std::span<const Path> paths,
                      std::span<Contact> contacts) const
    {
        std::vector<Path> seen;
        const Pose back = piece.pose.inverse();
        const Vec3d a_of_piece = piece.a;
        for (const Walker& w : walkers) {
            const Seen::Place there = w.seen.at(w.s);
            const Vec3d a = back.scale * (back.rotation * Vec3d(paths[w.path].a - a_of_piece));
            seen.push_back({there.X, there.velocity, a, w.end - w.s, w.level * back.scale});
        }
        std::vector<Contact> found(seen.size());
        rest_->first_contact(seen, found);
        for (std::size_t i = 0; i < walkers.size(); ++i) {
            if (found[i].time == Contact::none) continue;
            const Walker& w = walkers[i];
            Contact& contact = contacts[w.path] = found[i];
            contact.time += w.s;
            contact.n = piece.pose.rotation * contact.n;
            contact.vc = w.seen.surface_velocity(contact.time);
            contact.curvature /= piece.pose.scale;
            // The beginning was found to be outside, to the rounding of places in the world.
            contact.depth = 0;
            contact.back = Contact::none;
        }
    }

    // A step of all walkers in turn, with one question to the rest shape.
    void walk(std::vector<Walker>& walkers, std::span<const Path> paths, std::span<Contact> contacts) const
    {
        std::vector<double> next, phi, hops;
        std::vector<Vec3d> X, gradient;
        while (true) {
            std::erase_if(walkers, [&](Walker& w) { return is_over(w, paths[w.path], contacts[w.path]); });
            if (walkers.empty()) return;
            next.clear(), X.clear(), hops.clear();
            for (const Walker& w : walkers) {
                hops.push_back(hop_of(w, paths[w.path]));
                next.push_back(std::min(w.end, w.s + std::max(step(w), hops.back())));
                X.push_back(w.seen.at(next.back()).X);
            }
            ask(X, phi, gradient);
            for (std::size_t i = 0; i < walkers.size(); ++i) {
                Walker& w = walkers[i];
                const Seen::Place there = w.seen.at(next[i]);
                const double f = phi[i] - w.level / there.scale;
                if (f < 0 && !convex_) {
                    const double s = refine(w, next[i], f, close(paths[w.path], there.scale));
                    meet(w, s, contacts[w.path], s + 0x1p-8 * (next[i] - w.s));
                    w.end = w.s;
                    continue;
                }
                // Below the surface after a hop, or below the rounding of the time: as good as there.
                if ((f < 0 && hops[i] > 0) || !(next[i] > w.s)) {
                    meet(w, w.s, contacts[w.path]);
                    w.end = w.s;
                    continue;
                }
                w.s = next[i];
                w.f = f;
                w.slope = gradient[i].dot(there.velocity) + w.level * there.level_rate;
                ++w.steps;
            }
        }
    }

    bool is_over(Walker& w, const Path& path, Contact& contact) const
    {
        constexpr int most = 500;  // of a convex shape: a graze halves the distance each time
        if (convex_) {
            const Seen::Place there = w.seen.at(w.s);
            const double near = close(path, there.scale);
            if (w.f <= near) {
                // The graze of a point that is leaving is no contact.
                if (w.slope < 0 && !is_along(w.slope, there.velocity)) {
                    meet(w, w.s, contact);
                    return true;
                }
                w.f = near;
            }
            if (w.steps >= most) return meet(w, w.s, contact), true;
        }
        return !(w.s < w.end);
    }

    // Along a face of a convex shape, flush with it, the bound on the acceleration would make steps of nothing but
    // rounding: s of a hop that may dip into the surface by no more than what counts as flush; 0 elsewhere.
    double hop_of(const Walker& w, const Path& path) const
    {
        const double acceleration = w.seen.acceleration(w.level);
        if (!convex_ || !(acceleration > 0)) return 0;
        const double scale = w.seen.at(w.s).scale, near = flush(path, scale * rounding_) / scale;
        return w.f <= near && w.slope * w.slope <= 2 * acceleration * near ? 2 * std::sqrt(2 * near / acceleration) : 0;
    }

    // s that the walker can go without reaching the surface; of a field that is no convex function, or a quarter of the
    // smallest feature.
    double step(const Walker& w) const
    {
        const double acceleration = w.seen.acceleration(w.level);
        if (!convex_) {
            const double slope = rest_->slope_bound();
            const double speed = w.seen.at(w.s).velocity.norm() + w.seen.speed_beside(w.level) / slope;
            return detail::time_to_travel(std::max(w.f / slope, rest_->smallest_feature() / 4), speed, acceleration);
        }
        const double approaching = -w.slope;
        if (acceleration == 0 && approaching <= 0) return Contact::none;
        const double root = std::sqrt(approaching * approaching + 2 * acceleration * w.f);
        return approaching > 0 ? 2 * w.f / (approaching + root) : (root - approaching) / acceleration;
    }

    // The last time at which the path is outside, of a step at whose end it is not.
    double refine(const Walker& w, double after, double f_after, double close) const
    {
        const double speed = w.seen.at(w.s).velocity.norm() + (after - w.s) * w.seen.acceleration(w.level);
        Vec3d gradient;
        return last_outside([&](double s) { return height(w, s, gradient); }, w.s, w.f, after, f_after, speed, close);
    }

    ShapePtr rest_;
    MotionTrack track_;
    bool convex_;
    double rounding_;  // of a distance, rest units
    Box3d bounds_;
};

}  // namespace

ShapePtr moving(const ShapePtr& rest, const Motion& motion, const FrameClock& clock, double from, double to)
{
    return std::make_shared<MovingShape>(rest, MotionTrack(motion, clock, from, to));
}

}  // namespace rapid

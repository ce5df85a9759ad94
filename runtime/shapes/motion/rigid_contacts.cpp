#include "runtime/shapes/motion/rigid_contacts.h"

#include <algorithm>
#include <cmath>

namespace rapid {

RelativePath::RelativePath(const MotionTrack::Piece& piece, const Path& path, double first, double last)
    : piece_(&piece), path_(&path), first_(first), begin_(arm_at(first))
{
    const double T = last - first;
    const Arm& begin = begin_;
    const Arm end = arm_at(last);
    const double k = std::min(begin.scale, end.scale), growth = std::abs(piece.growth) / k;
    const double turning = piece.spin.norm(), a = (path.a - piece.a).norm();
    // The relative velocity is linear in time, so it is largest at an end. The path in between deviates from its chord
    // by at most a T²/8.
    const double speed = std::max(begin.relative_velocity.norm(), end.relative_velocity.norm());
    const double sag = a * T * T / 8, arm = std::max(begin.arm.norm(), end.arm.norm()) + sag;
    // Distances from the axis: the part along it does not turn.
    const auto lever = [&](const Vec3d& x) { return x.cross(piece.spin).norm(); };
    const double turned = turning > 0 ? std::max(lever(begin.arm), lever(end.arm)) + turning * sag : 0;
    acceleration_ =
        (a + 2 * turning * speed + turning * turned + 2 * growth * (speed + turned) + 2 * growth * growth * arm) / k;
    level_speed_ = std::abs(piece.growth) / (k * k);
    level_acceleration_ = 2 * growth * growth / k;
}

RelativePath::State RelativePath::at(double s) const
{
    const Arm f = s == first_ ? begin_ : arm_at(s);
    const Eigen::Quaterniond back = f.rotation.conjugate();
    const Vec3d slip = f.relative_velocity - piece_->spin.cross(f.arm) - piece_->growth / f.scale * f.arm;
    return {back * f.arm / f.scale, back * slip / f.scale, f.scale, f.rotation, piece_->growth / (f.scale * f.scale)};
}

RelativePath::Arm RelativePath::arm_at(double s) const
{
    const double t = path_->begin + s;
    const Pose pose = piece_->at(t);
    return {path_->at(s) - pose.translation, path_->velocity(s) - (piece_->v + (t - piece_->begin) * piece_->a),
            pose.rotation, pose.scale};
}

RestShape::RestShape(ShapePtr rest)
    : shape(std::move(rest)),
      slope_bound(shape->slope_bound()),
      feature(shape->smallest_feature()),
      rounding(std::isfinite(shape->band()) ? 0x1p-21 * shape->band() : 0)
{
}

void RigidContacts::find()
{
    const std::size_t n = beginnings_.size();
    std::vector<RelativePath::State> states;
    std::vector<Vec3d> X, gradient(n);
    std::vector<double> phi(n);
    for (const Beginning& b : beginnings_) {
        states.push_back(b.relative.at(b.from));
        X.push_back(states.back().X);
    }
    rest_.shape->distance(X, phi, gradient);
    for (std::size_t i = 0; i < n; ++i) begin(beginnings_[i], states[i], phi[i], gradient[i]);
    if (piece_.only_translates())
        fly_straight();
    else
        walk();
}

// Writes an immediate contact or starts a walk.
void RigidContacts::begin(const Beginning& b, const RelativePath::State& here, double phi, const Vec3d& gradient)
{
    const Path& path = paths_[b.path];
    const double f = here.scale * phi - path.radius;
    const double flush = flush_within(path.P, path.radius, here.scale * rest_.rounding);
    if (b.from == 0 && f < -flush) {
        contacts_[b.path] = inside(b, here);
        return;
    }
    const RigidField field(rest_, b.relative, path.radius + std::min(f, 0.0));
    ContactWalk walk(field, field.sample(here, phi, gradient), b.from, b.to);
    if (!(f > flush)) walk.leave_surface(2 * flush / here.scale);
    if (walk.is_over())
        contacts_[b.path] = walk.contact();
    else
        walkers_.push_back({b.path, b.to, walk});
}

// Returns the contact of a path that starts inside. The rest shape finds the way out, for a straight path.
Contact RigidContacts::inside(const Beginning& b, const RelativePath::State& here) const
{
    const Path& path = paths_[b.path];
    const Path now{here.X, here.velocity, Vec3d::Zero(), 0, path.radius / here.scale};
    Contact contact;
    rest_.shape->first_contact({&now, 1}, {&contact, 1});
    // The point counts as flush in the rest frame, where the shape is farther from the origin and the tolerance larger.
    if (contact.time == Contact::none) return contact_at(RigidField(rest_, b.relative, path.radius), 0, {});
    contact.time = 0;
    contact.n = here.rotation * contact.n;
    contact.vc = b.relative.surface_velocity(0);
    contact.depth *= here.scale;
    contact.curvature /= here.scale;
    return contact;
}

// Finds contacts with a shape that only translates. A parabola in world space is also one in its frame.
void RigidContacts::fly_straight()
{
    std::vector<Path> relative;
    const Pose back = piece_.pose.inverse();
    for (const Walker& w : walkers_) {
        const auto& here = w.walk.here();
        const Vec3d a = back.scale * (back.rotation * Vec3d(paths_[w.path].a - piece_.a));
        relative.push_back({here.X, here.velocity, a, w.end - w.walk.time(), w.walk.field().level() * back.scale});
    }
    std::vector<Contact> found(relative.size());
    rest_.shape->first_contact(relative, found);
    for (std::size_t i = 0; i < walkers_.size(); ++i) {
        if (found[i].time == Contact::none) continue;
        const Walker& w = walkers_[i];
        Contact& contact = contacts_[w.path] = found[i];
        contact.time += w.walk.time();
        contact.n = piece_.pose.rotation * contact.n;
        contact.vc = w.walk.field().path().surface_velocity(contact.time);
        contact.curvature /= piece_.pose.scale;
        // The start was classified as outside, up to the rounding of positions in world space.
        contact.depth = 0;
        contact.back = Contact::none;
    }
}

// Advances all walks step by step, with one query of the rest shape per step.
void RigidContacts::walk()
{
    std::vector<RelativePath::State> states;
    std::vector<Vec3d> X, gradient;
    std::vector<double> phi;
    while (true) {
        std::erase_if(walkers_, [&](Walker& w) {
            if (w.walk.proceeds()) return false;
            contacts_[w.path] = w.walk.contact();
            return true;
        });
        if (walkers_.empty()) return;
        states.clear();
        X.clear();
        for (const Walker& w : walkers_) {
            states.push_back(w.walk.field().path().at(w.walk.next()));
            X.push_back(states.back().X);
        }
        phi.resize(X.size());
        gradient.resize(X.size());
        rest_.shape->distance(X, phi, gradient);
        for (std::size_t i = 0; i < walkers_.size(); ++i) {
            ContactWalk<RigidField>& walk = walkers_[i].walk;
            walk.advance(walk.field().sample(states[i], phi[i], gradient[i]));
        }
    }
}

}  // namespace rapid

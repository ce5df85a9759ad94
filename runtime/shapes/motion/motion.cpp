#include "runtime/shapes/motion/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/math/elementary.h"

namespace rapid {
namespace {

// Maximum error, relative to the distance that the body travels in the interval, and in rad.
constexpr double track_error = 1e-5;
constexpr double min_piece = 1.0 / 64;  // fraction of the interval

class ConstantMotion final : public Motion {
public:
    ConstantMotion(const Pose& pose, std::optional<Turns> turns) : pose_(pose), turns_(std::move(turns)) {}
    Pose at(const Frame&) const override { return pose_; }
    FrameRange range() const override { return {}; }
    const std::optional<Turns>& turns() const { return turns_; }

private:
    Pose pose_;
    std::optional<Turns> turns_;
};

// Returns 1 if two axes are equal, -1 if they are opposite, 0 otherwise.
int sense(const Vec3d& a, const Vec3d& b)
{
    constexpr double rounding = 1e-12;  // of the product of two unit vectors
    const double along = a.dot(b);
    return along > 1 - rounding ? 1 : along < rounding - 1 ? -1 : 0;
}

// Concatenates rotations. Returns nothing if one is unknown, or if there are more than a scene would state, as in a
// product in a loop.
std::optional<Turns> in_turn(std::optional<Turns> first, const std::optional<Turns>& second)
{
    constexpr std::size_t most = 8;
    if (!first || !second || first->size() + second->size() > most) return std::nullopt;
    for (const Turn& turn : *second) {
        const int same = first->empty() ? 0 : sense(first->back().axis, turn.axis);
        if (same == 0)
            first->push_back(turn);
        else
            first->back().angle += same * turn.angle;
    }
    return first;
}

class ProductMotion final : public Motion {
public:
    ProductMotion(MotionPtr first, MotionPtr second)
        : first_(std::move(first)), second_(std::move(second)), factors_(factors_of(*first_) + factors_of(*second_))
    {
        // Factors are evaluated recursively, and the stack of a thread has room for some thousands.
        constexpr double most = 1000;
        if (factors_ > most)
            throw Error(
                fmt::format("a product has {:g} motions, some of which vary; at most {} are possible: compute them in "
                            "one function of the frame",
                            factors_, most));
    }
    Pose at(const Frame& frame) const override { return first_->at(frame) * second_->at(frame); }
    FrameRange range() const override
    {
        FrameRange range = first_->range();
        range.extend(second_->range());
        return range;
    }

private:
    static double factors_of(const Motion& motion)
    {
        const auto* product = dynamic_cast<const ProductMotion*>(&motion);
        return product ? product->factors_ : 1;
    }

    MotionPtr first_, second_;
    double factors_;  // a double, because a product with itself doubles the count
};

class BackwardMotion final : public Motion {
public:
    BackwardMotion(MotionPtr motion, const FrameClock& clock, double frame)
        : motion_(std::move(motion)), clock_(clock), frame_(frame)
    {
    }

    Pose at(const Frame& frame) const override
    {
        const Pose there = motion_->at(clock_.at(frame_));
        const Pose ahead = motion_->at(clock_.at(2 * frame_ - frame.number));
        return there * ahead.inverse() * there;
    }
    FrameRange range() const override { return motion_->range(); }

private:
    MotionPtr motion_;
    FrameClock clock_;
    double frame_;
};

class KeyedMotion final : public Motion {
public:
    KeyedMotion(std::map<std::int64_t, Pose> keys, std::map<std::int64_t, Turns> turns)
        : keys_(std::move(keys)), turns_(std::move(turns))
    {
    }

    Pose at(const Frame& frame) const override
    {
        const auto after = std::find_if(keys_.begin(), keys_.end(),
                                        [&](const auto& key) { return static_cast<double>(key.first) > frame.number; });
        if (after == keys_.begin()) return after->second;
        const auto before = std::prev(after);
        if (after == keys_.end()) return before->second;
        const auto from = static_cast<double>(before->first), to = static_cast<double>(after->first);
        const double t = (frame.number - from) / (to - from);
        Pose pose = interpolate(before->second, after->second, t);
        if (const auto turned = turned_far(before->first, after->first, t)) pose.rotation = *turned;
        return pose;
    }
    FrameRange range() const override
    {
        return {static_cast<double>(keys_.begin()->first), static_cast<double>(keys_.rbegin()->first)};
    }

private:
    // Returns the rotation between two keys that turn about the same axes, by half a turn or more about one of them.
    // Returns nothing for other keys, whose rotation takes the shorter way.
    std::optional<Eigen::Quaterniond> turned_far(std::int64_t before, std::int64_t after, double t) const
    {
        const auto from = turns_.find(before), to = turns_.find(after);
        if (from == turns_.end() || to == turns_.end()) return std::nullopt;
        const Turns &a = from->second, &b = to->second;
        if (a.size() != b.size() && !a.empty() && !b.empty()) return std::nullopt;
        constexpr double half = EIGEN_PI - 1e-9;  // rad; at half a turn both ways are equally short
        bool far = false;
        Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
        for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
            const Vec3d& axis = a.empty() ? b[i].axis : a[i].axis;
            const int same = a.empty() || b.empty() ? 1 : sense(axis, b[i].axis);
            if (same == 0) return std::nullopt;
            const double first = a.empty() ? 0 : a[i].angle, last = b.empty() ? 0 : same * b[i].angle;
            far = far || std::abs(last - first) > half;
            rotation = rotation * Eigen::AngleAxisd(first + t * (last - first), axis);
        }
        return far ? std::optional(rotation.normalized()) : std::nullopt;
    }

    std::map<std::int64_t, Pose> keys_;
    std::map<std::int64_t, Turns> turns_;
};

// Returns the rotation vector of the shorter way from a to b, rad.
Vec3d turn(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b)
{
    Eigen::Quaterniond q = b * a.conjugate();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    return sine > 0 ? Vec3d(2 * std::atan2(sine, q.w()) / sine * q.vec()) : Vec3d(Vec3d::Zero());
}

// Returns the piece through three poses; `middle` is at half the time.
MotionTrack::Piece through(double begin, double end, const Pose& from, const Pose& middle, const Pose& to)
{
    const double T = end - begin;
    MotionTrack::Piece piece{begin, end, from, Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero(), 0, 0};
    if (!(T > 0)) return piece;
    const Vec3d chord = to.translation - from.translation;
    Vec3d sag = from.translation + to.translation - 2 * middle.translation;
    // The rounding of a straight translation must not become an acceleration.
    if (sag.cwiseAbs().maxCoeff() <=
        0x1p-49 * from.translation.cwiseAbs().cwiseMax(to.translation.cwiseAbs()).maxCoeff())
        sag.setZero();
    piece.a = 4 / (T * T) * sag;
    piece.v = chord / T - 0.5 * T * piece.a;
    piece.spin = turn(from.rotation, to.rotation) / T;
    piece.rate = piece.spin.norm();
    if (piece.rate > 0) piece.axis = piece.spin / piece.rate;
    piece.growth = (to.scale - from.scale) / T;
    return piece;
}

// Evaluates a motion and bisects the interval until its pieces are accurate enough.
class TrackBuilder {
public:
    TrackBuilder(const Motion& motion, const FrameClock& clock, double from, double to)
        : motion_(motion), clock_(clock), from_(from), to_(to)
    {
    }

    std::vector<MotionTrack::Piece> build()
    {
        const Pose first = at(0);
        if (!motion_.varies()) return {through(0, (to_ - from_) / clock_.fps, first, first, first)};
        const Pose middle = at(0.5), last = at(1);
        travel_ = (middle.translation - first.translation).norm() + (last.translation - middle.translation).norm();
        bisect(0, 1, first, middle, last);
        return std::move(pieces_);
    }

private:
    Pose at(double u) const { return motion_.at(clock_.at(u == 1 ? to_ : from_ + u * (to_ - from_))); }

    void bisect(double begin, double end, const Pose& first, const Pose& middle, const Pose& last)
    {
        const double seconds = (to_ - from_) / clock_.fps, half = 0.5 * (begin + end);
        const MotionTrack::Piece piece = through(begin * seconds, end * seconds, first, middle, last);
        // Compares at two times, so that no number of whole turns can go unnoticed.
        const double off = begin + 0.381966 * (end - begin);
        if (end - begin <= min_piece || (near(piece.at(half * seconds), middle, last.scale) &&
                                         near(piece.at(off * seconds), at(off), last.scale))) {
            pieces_.push_back(piece);
            return;
        }
        bisect(begin, half, first, at(0.5 * (begin + half)), middle);
        bisect(half, end, middle, at(0.5 * (half + end)), last);
    }

    bool near(const Pose& guess, const Pose& exact, double scale) const
    {
        const double rounding = 0x1p-45 * exact.translation.cwiseAbs().maxCoeff();
        return (guess.translation - exact.translation).norm() <= track_error * travel_ + rounding &&
               turn(guess.rotation, exact.rotation).norm() <= track_error &&
               std::abs(guess.scale - exact.scale) <= track_error * scale;
    }

    const Motion& motion_;
    FrameClock clock_;
    double from_, to_;
    double travel_ = 0;  // m
    std::vector<MotionTrack::Piece> pieces_;
};

}  // namespace

MotionPtr constant_motion(const Pose& pose)
{
    const bool is_turned = pose.rotation.coeffs() != Eigen::Quaterniond::Identity().coeffs();
    return std::make_shared<ConstantMotion>(pose, is_turned ? std::nullopt : std::optional(Turns()));
}

MotionPtr constant_motion(const Pose& pose, Turns turns)
{
    return std::make_shared<ConstantMotion>(pose, std::move(turns));
}

std::optional<Turns> turns_of(const Motion& motion)
{
    const auto* constant = dynamic_cast<const ConstantMotion*>(&motion);
    return constant ? constant->turns() : std::nullopt;
}

MotionPtr product(const MotionPtr& first, const MotionPtr& second)
{
    if (!first->varies() && !second->varies()) {
        const Pose pose = first->at({}) * second->at({});
        const std::optional<Turns> turns = in_turn(turns_of(*first), turns_of(*second));
        return turns ? constant_motion(pose, *turns) : std::make_shared<ConstantMotion>(pose, std::nullopt);
    }
    return std::make_shared<ProductMotion>(first, second);
}

MotionPtr going_back(const MotionPtr& motion, const FrameClock& clock, double frame, bool continues)
{
    if (!continues) return constant_motion(motion->at(clock.at(frame)));
    return std::make_shared<BackwardMotion>(motion, clock, frame);
}

MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys) { return keyed_motion(std::move(keys), {}); }

MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys, std::map<std::int64_t, Turns> turns)
{
    if (keys.empty()) throw Error("a motion by keys has no keys; give a motion for at least one frame, {[1] = ...}");
    if (keys.size() == 1) return constant_motion(keys.begin()->second);
    return std::make_shared<KeyedMotion>(std::move(keys), std::move(turns));
}

Pose MotionTrack::Piece::at(double s) const
{
    const double t = s - begin;
    Pose now{pose.translation + t * (v + 0.5 * t * a), pose.rotation, pose.scale + t * growth};
    if (rate > 0) {
        const auto [sine, cosine] = sine_and_cosine(0.5 * t * rate);
        const Vec3d vec = sine * axis;
        now.rotation = Eigen::Quaterniond(cosine, vec.x(), vec.y(), vec.z()) * pose.rotation;
    }
    return now;
}

VelocityField MotionTrack::Piece::velocity_at(double s) const
{
    const double t = s - begin;
    return {v + t * a, spin, growth / (pose.scale + t * growth), pose.translation + t * (v + 0.5 * t * a)};
}

MotionTrack::MotionTrack(const Motion& motion, const FrameClock& clock, double from, double to)
    : pieces_(TrackBuilder(motion, clock, from, to).build())
{
}

const MotionTrack::Piece& MotionTrack::piece_at(double s) const
{
    const auto after = std::find_if(pieces_.begin(), pieces_.end(), [s](const Piece& piece) { return s < piece.end; });
    return after == pieces_.end() ? pieces_.back() : *after;
}

}  // namespace rapid

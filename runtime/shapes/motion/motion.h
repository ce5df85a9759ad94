// Motions: the pose of a body as a function of time. A motion is a constant, a product, keyframes, or a script's
// function.
//
// A motion is evaluated in advance on one thread, because it may be a script. Worker threads read the poses of a
// MotionTrack.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "runtime/base/frame.h"
#include "runtime/base/object.h"
#include "runtime/math/vec.h"
#include "runtime/shapes/pose.h"

namespace rapid {

// The range of frames in which a motion moves. It is at rest outside.
struct FrameRange {
    double first = std::numeric_limits<double>::infinity(), last = -std::numeric_limits<double>::infinity();

    bool empty() const { return first > last; }
    void extend(const FrameRange& other)
    {
        first = std::min(first, other.first);
        last = std::max(last, other.last);
    }
};

class Motion : public Object {
public:
    static constexpr std::string_view param_type = "motion";
    std::string_view kind() const override { return "motion"; }

    // Single-threaded. Throws Error if the script does.
    virtual Pose at(const Frame& frame) const = 0;
    // Returns the frames in which it moves: empty for a constant, infinite for a script.
    virtual FrameRange range() const = 0;
    bool varies() const override { return !range().empty(); }
};

using MotionPtr = std::shared_ptr<const Motion>;

MotionPtr constant_motion(const Pose& pose);
// Returns the composition: `second` is applied first, then `first`.
MotionPtr product(const MotionPtr& first, const MotionPtr& second);
// Returns the motion up to a frame that a body reached by a jump: it mirrors in time the motion after that frame. It is
// at rest if `continues` is false.
MotionPtr going_back(const MotionPtr& motion, const FrameClock& clock, double frame, bool continues);
// Interpolates between the given frames; at rest outside them. Throws Error if there are no keys.
MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys);

// A motion over a time interval, as pieces with a parabolic translation, a constant angular velocity and a linear
// scale. A constant, keys, a uniform acceleration and a uniform spin are one exact piece. Other motions are bisected
// into up to 64 pieces, until the error is within 1e-5 of the distance that the body travels in the interval.
class MotionTrack {
public:
    struct Piece {
        double begin, end;  // s
        Pose pose;          // at `begin`
        Vec3d v, a;         // of the translation: m/s at `begin`, m/s²
        Vec3d spin;         // angular velocity, rad/s
        Vec3d axis;         // unit vector along the spin, or 0
        double rate;        // rad/s about the axis
        double growth;      // rate of change of the scale, 1/s

        Pose at(double s) const;
        VelocityField velocity_at(double s) const;
        bool only_translates() const { return spin.isZero(0) && growth == 0; }
    };

    // Evaluates the motion between two frames, which may be fractional. Times are in seconds since `from`.
    // Single-threaded.
    MotionTrack(const Motion& motion, const FrameClock& clock, double from, double to);

    std::span<const Piece> pieces() const { return pieces_; }  // in order; at least one
    double duration() const { return pieces_.back().end; }     // s
    const Piece& piece_at(double s) const;
    Pose at(double s) const { return piece_at(s).at(s); }
    VelocityField velocity_at(double s) const { return piece_at(s).velocity_at(s); }

private:
    std::vector<Piece> pieces_;
};

// A rotation about an axis, including whole turns.
struct Turn {
    Vec3d axis;    // of length 1
    double angle;  // rad
};
// A product of rotations, applied from last to first. Neighbours have different axes.
using Turns = std::vector<Turn>;

// Creates a constant motion from a pose and the rotations that compose it.
MotionPtr constant_motion(const Pose& pose, Turns turns);
// Returns the rotations of a constant motion; nothing if they are unknown or the motion varies.
std::optional<Turns> turns_of(const Motion& motion);

// Like keyed_motion(Pose). Between two keys that turn about the same axes, by half a turn or more about one of them,
// each angle is linear in time. Other rotations take the shorter way. turns: rotations of the keys for which they are
// known.
MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys, std::map<std::int64_t, Turns> turns);

}  // namespace rapid

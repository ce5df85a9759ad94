// Motions: the pose of a body at each time. A constant, a product, keys, or a script's function.
//
// A motion is evaluated ahead, on one thread, because it may be a script; worker threads read the poses of a
// MotionTrack.
#pragma once

#include <limits>
#include <map>
#include <span>
#include <vector>

#include "runtime/frame.h"
#include "runtime/object.h"
#include "runtime/shapes/pose.h"
#include "runtime/vec.h"

namespace rapid {

// The frames between which a motion moves. Beyond them it is at rest.
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

    // On one thread. Error: that of a script.
    virtual Pose at(const Frame& frame) const = 0;
    // Empty for a constant; infinite for a script.
    virtual FrameRange range() const = 0;
    bool varies() const override { return !range().empty(); }
};

using MotionPtr = std::shared_ptr<const Motion>;

MotionPtr constant_motion(const Pose& pose);
// First `second`, then `first`.
MotionPtr product(const MotionPtr& first, const MotionPtr& second);
// The motion up to a frame at which a body has arrived by a jump: what `motion` does after that frame, backwards. At
// rest if it does not go on.
MotionPtr going_back(const MotionPtr& motion, const FrameClock& clock, double frame, bool goes_on);
// Interpolated between the given frames, and at rest outside them. Error: no keys.
MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys);

// A motion over an interval of time, as pieces in which the translation is a parabola, the angular velocity is constant
// and the scale is linear. A constant, keys, a uniform acceleration and a uniform spin are one exact piece; others are
// bisected, into up to 64 pieces, until the error is within 1e-5 of the distance that the body travels in the interval.
class MotionTrack {
public:
    struct Piece {
        double begin, end;  // s
        Pose pose;          // at its beginning
        Vec3d v, a;         // of the translation: m/s at its beginning, m/s²
        Vec3d spin;         // angular velocity, rad/s
        Vec3d axis;         // unit vector along the spin; 0 where there is none
        double rate;        // rad/s about the axis
        double growth;      // of the scale, 1/s

        Pose at(double s) const;
        VelocityField velocity_at(double s) const;
        bool only_translates() const { return spin.isZero(0) && growth == 0; }
    };

    // Between two frames, whole or not. Times are in seconds since `from`. On one thread.
    MotionTrack(const Motion& motion, const FrameClock& clock, double from, double to);

    std::span<const Piece> pieces() const { return pieces_; }  // in order; at least one
    double duration() const { return pieces_.back().end; }     // s
    const Piece& piece_at(double s) const;
    Pose at(double s) const { return piece_at(s).at(s); }
    VelocityField velocity_at(double s) const { return piece_at(s).velocity_at(s); }

private:
    std::vector<Piece> pieces_;
};

}  // namespace rapid

// Rotations as they were written: by any angle, about which a pose tells no more than the shorter way to it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "runtime/shapes/motion/motion.h"

namespace rapid {

// Whole turns are included.
struct Turn {
    Vec3d axis;    // of length 1
    double angle;  // rad
};
// A product of rotations, the last of which is done first. No two neighbours have one axis.
using Turns = std::vector<Turn>;

// A constant with the rotations that make its pose.
MotionPtr constant_motion(const Pose& pose, Turns turns);
// Those of a constant. Nothing if they are unknown, or the motion varies.
std::optional<Turns> turns_of(const Motion& motion);

// As keyed_motion(). Between two keys that turn about the same axes, by half a turn or more about one of them, each
// angle is linear in time; between others the rotation takes the shorter way. turns: of the keys of which they are
// known.
MotionPtr keyed_motion(std::map<std::int64_t, Pose> keys, std::map<std::int64_t, Turns> turns);

}  // namespace rapid

// Rotations as the scene states them, by any angle. A pose only stores the shortest equivalent.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "runtime/shapes/motion/motion.h"

namespace rapid {

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

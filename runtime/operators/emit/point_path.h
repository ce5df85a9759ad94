// The curves along which the points of a source travel in one step, where the source is another set at each step: a
// function of the frame, such as one that reads a sequence of files. Points are the same where their id is.
//
// Where the attribute v is the rate at which positions change, the curve is the cubic Hermite spline of both, which is
// the path to third order. Else its tangents are differences: of second order from the third step on, straight before.
// A point that was not there goes back along its v, or is at rest.
#pragma once

#include "runtime/frame.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

struct PointPath {
    BodyPathPtr path;           // births are given on the points of `now`, by element
    std::size_t unmatched = 0;  // points of `now` that were not there before
    bool follows_v = false;     // v is the rate at which positions change: path gives it, not the attribute
};

// now, before: the source at the end and the beginning of a step of `dt` seconds; earlier: a step before that, or null.
PointPath point_path(const PointSet& now, const PointSet& before, const PointSet* earlier, bool straight, double dt);

}  // namespace rapid

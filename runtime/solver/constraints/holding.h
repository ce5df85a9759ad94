// Constraints that hold single points by springs, alike along all axes.
//
// To an impulse p of contacts, shapes and rods a spring of softness s (Row::keep) gives way by
//
//   w p dt / (1 + w/s)      as a point of the inverse mass 1/(1/w + 1/s) does
//
// and its point has that mass while these act. They then find at once what the spring bears: row by row, a heavy point
// on a light one that is held would take as many iterations as the ratio of their masses.
#pragma once

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// What a Coupling is, too, that holds points so.
class Holding {
public:
    virtual ~Holding() = default;

    // Before detect(): points count as heavier from here on.
    virtual void hold(Substep& step) = 0;
    // After project(): springs have the forces that have come of it.
    virtual void settle(Substep& step) = 0;
    // After solve_velocities(): points have their own masses again.
    virtual void release(Substep& step) = 0;
};

}  // namespace rapid

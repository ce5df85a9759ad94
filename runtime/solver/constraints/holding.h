// Constraints that hold single points by isotropic springs.
//
// Under an impulse p from contacts, shapes or rods, a spring of softness s (Row::keep) yields by
//
//   w p dt / (1 + w/s)      like a point of inverse mass 1/(1/w + 1/s)
//
// and its point has that mass while these act, so they account for the spring's support at once. Row by row, a heavy
// point on a light one that is held would take iterations in proportion to the mass ratio.
#pragma once

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// An interface that such a Coupling also implements.
class Holding {
public:
    virtual ~Holding() = default;

    // Is called before detect(). Makes the points count as heavier from here on.
    virtual void hold(Substep& step) = 0;
    // Is called after project(). Updates the springs' forces with the result.
    virtual void settle(Substep& step) = 0;
    // Is called after solve_velocities(). Restores the points' masses.
    virtual void release(Substep& step) = 0;
};

}  // namespace rapid

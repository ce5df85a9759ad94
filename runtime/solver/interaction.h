// What neighbours do to each other: separation, cohesion, alignment and drag, after Yuksel et al. 2014.
//
// Points i and j that are d < radius apart, with n the direction from i to j, weigh w = 1 - d / radius on each other.
// Of points of equal mass each gets the acceleration
//
//   a_i = share (-separation w n + cohesion 4 w (1 - w) n + alignment w (v_j - v_i) + drag w n (v_j - v_i)·n)
//   share = 1 / max(1, Σ w of i, Σ w of j)
//
// so that it is an average over the neighbours, as flocks have it, and the same for both: momentum is kept, and by all
// but alignment angular momentum too. Of unequal masses 2 m_j / (m_i + m_j) of it, with half the sum of their
// strengths.
//
// It is applied as a kick of half the frame before the points move and one of half the frame after: of second order in
// the frame's length by place, of first in alignment and drag. The neighbours are those of the frame's ends, whatever
// the sub-steps: a frame is made finer by create's subframes. However strong, a kick brings velocities together at the
// most, never past each other, and moves neighbours in a frame at the most out to the radius, or together.
#pragma once

#include <span>

#include "runtime/solver/dynamics.h"
#include "runtime/solver/solve.h"

namespace rapid {

class Interaction : public Dynamic {
public:
    double radius = 1;                                 // m
    PerPoint<float> separation{0.0f}, cohesion{0.0f};  // m/s²
    PerPoint<float> alignment{0.0f}, drag{0.0f};       // 1/s
};

// Half the frame's kicks of all interactions among `dynamics`, on the velocities; each of half the point's own time.
// Points that the solve does not advance act, and are not moved. Same bits for any number of threads.
void interact(PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

}  // namespace rapid

// Forces among neighbours: separation, cohesion, alignment and drag, after Yuksel et al. 2014.
//
// For points i and j at a distance d < radius, with n the direction from i to j, the weight is w = 1 - d / radius.
// Points of equal mass each get the acceleration
//
//   a_i = share (-separation w n + cohesion 4 w (1 - w) n + alignment w (v_j - v_i) + drag w n (v_j - v_i)·n)
//   share = 1 / max(1, Σ w of i, Σ w of j)
//
// which is an average over the neighbours, as for flocks, and equal for both: it conserves momentum and, except for
// alignment, angular momentum. Unequal masses get 2 m_j / (m_i + m_j) of it, with the mean of their strengths.
//
// Points that look ahead also turn aside from points that they would pass closer than `clearance`. With u = v_j - v_i,
// the time of the nearest approach τ = -d·u / u², up to `foresight`, and the vector between them at that time, e = d n
// + τ u:
//
//   a_i = share (-avoidance (1 - |e| / clearance) (1 - τ / foresight) e / |e|)
//
// If a point does not see all others (an angle of `view` around its velocity; at rest in all directions), or heeds
// only the nearest few, the share is 1 / max(1, Σ w of i) over those that it heeds. They need not heed it, so momentum
// is not conserved.
//
// It is applied as a kick of half a step before the points move and one of half a step after: second order in the
// step's length by position, first order in alignment and drag. The step is the substep, at whose ends neighbours are
// found; with a tolerance, which gives each point individual substeps, it is the frame. However strong, a kick at most
// makes velocities equal, and moves neighbours in a step at most to the radius, or together.
#pragma once

#include <span>

#include "runtime/solver/dynamics.h"
#include "runtime/solver/solve.h"

namespace rapid {

class Interaction : public Dynamic {
public:
    // Returns the interaction at a time, s since the start.
    virtual const Interaction& at(double) const { return *this; }

    double radius = 1;                                 // m
    PerPoint<float> separation{0.0f}, cohesion{0.0f};  // m/s²
    PerPoint<float> alignment{0.0f}, drag{0.0f};       // 1/s
    PerPoint<float> avoidance{0.0f};                   // m/s²
    double foresight = 1, clearance = 0.5;             // s, m
    double view = 2 * EIGEN_PI;                        // rad
    int most = 0;                                      // neighbours that a point heeds; 0: all

    bool sees_all() const { return view >= 2 * EIGEN_PI * (1 - 1e-9); }
    bool is_selective() const { return !sees_all() || most > 0; }
};

// Points within a frame; shapes [n].
struct InteractingPoints {
    std::span<const Vec3d> P;            // m
    std::span<Vec3d> v;                  // m/s
    std::span<const std::uint8_t> dead;  // 1: no longer takes part; empty if no point can have died
    double time = 0;                     // s since the start
    int steps = 1;                       // per frame
};

// Applies the half-step kicks of all interactions to the velocities, for half of each point's own time, `kicks` times.
// Points that the solver does not advance act on others, and are not changed. Bit-identical for any number of threads.
void interact(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options,
              const InteractingPoints& at, int kicks);
// The same for half the frame, with velocities in single precision. time: s since the start.
void interact(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double time = 0);

}  // namespace rapid

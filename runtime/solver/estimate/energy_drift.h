// What the integrator does to the energy of motion of points, kinetic and of the forces' potentials: 0 if it were
// exact.
//
// Of each point that has a shadow the change within each Solve is summed since its birth, but for the steps in which it
// met a shape, of which the audit of contacts tells (ContactEnergy). What nodes between two Solves do to a point is not
// in it, and neither is what a force does by changing from frame to frame. There is no such energy where a force is not
// the slope of a potential, and with actions, couplings and the attribute `force`.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/solve.h"

namespace rapid {

class EnergyDrift {
public:
    // Before Solve, when the shadows have begun. Where there is something to measure, `options` are told to note who
    // meets a shape.
    void begin(const PointSet& points, const Shadows& shadows, const Dynamics& dynamics, SolveOptions& options);

    // After Solve and the shadows' advance: of each point that has a shadow, in order of id, J/kg. Nothing where it is
    // not defined.
    std::optional<std::vector<double>> end(const PointSet& solved, const Shadows& shadows, const Dynamics& dynamics);

private:
    std::vector<std::int64_t> ids_;  // ascending
    std::vector<double> drift_;      // of these, J/kg

    // From begin() to end().
    bool defined_ = false;
    std::vector<double> before_;         // energies, J/kg
    std::vector<std::uint32_t> places_;  // before Solve
    bool meets_ = false;                 // there are colliders
    std::vector<std::uint8_t> met_;      // by place before Solve, of those that have a shadow
};

}  // namespace rapid

// Energy drift: the change of the kinetic and potential energy of points by the integrator, 0 if it were exact.
//
// For each point with a shadow, the change within each Solve is summed since its birth, except for steps in which it
// met a shape (those are in the audit of contacts, ContactEnergy). Changes by nodes between two Solves are not
// included. The energy is undefined with forces that are not conservative, with time-dependent forces, and with
// actions, couplings and the attribute `force`.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/solve.h"

namespace rapid {

class EnergyDrift {
public:
    // Call before Solve, after Shadows::begin(). Sets options.sinks.met if contacts must be recorded.
    void begin(const PointSet& points, const Shadows& shadows, const Dynamics& dynamics, SolveOptions& options);

    // Call after Solve and Shadows::advance(). Returns the drift of each point with a shadow, in order of id, J/kg;
    // nothing if it is undefined.
    std::optional<std::vector<double>> end(const PointSet& solved, const Shadows& shadows, const Dynamics& dynamics);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(ids_, drift_);
        if constexpr (Archive::is_loading::value) StateReader::expect(ascend(ids_) && drift_.size() == ids_.size());
    }

private:
    std::vector<std::int64_t> ids_;  // ascending
    std::vector<double> drift_;      // J/kg

    // From begin() to end().
    bool defined_ = false;
    std::vector<double> before_;          // energies, J/kg
    std::vector<std::uint32_t> indices_;  // before Solve
    bool collides_ = false;               // there are colliders
    std::vector<std::uint8_t> met_;       // by index before Solve; only valid for points with a shadow
};

}  // namespace rapid

// Energy drift: the change of the kinetic and potential energy of points by the integrator, 0 if it were exact.
//
// For each point that has a shadow, the change within each Solve is summed since its birth, without steps in which it
// met a shape (those are in the audit of contacts, ContactEnergy). Changes by nodes between two Solves are not
// included. The energy is not defined with forces that are not conservative, or that are functions of the frame and
// change, and with actions, couplings and the attribute `force`.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/estimate/shadow.h"
#include "runtime/solver/solve.h"

namespace rapid {

class EnergyDrift {
public:
    // Call before Solve, after Shadows::begin(). Sets options.met where contacts are to be recorded.
    void begin(const PointSet& points, const Shadows& shadows, const Dynamics& dynamics, SolveOptions& options);

    // Call after Solve and Shadows::advance(). Returns the drift of each point with a shadow, in order of id, J/kg;
    // nothing where it is not defined.
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
    std::vector<std::uint8_t> met_;       // by index before Solve; only those of points with a shadow are valid
};

}  // namespace rapid

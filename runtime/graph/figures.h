// The statistics of a frame, as counted by nodes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/estimate/resolution.h"
#include "runtime/solver/estimate/stiffness.h"
#include "runtime/solver/ledger.h"

namespace rapid {

// The narrow band of a level set, as the collisions of a frame need it (paper §4.3).
struct BandFigures {
    std::string node;
    double width = 0;  // m, on each side of the surface
    std::uint64_t voxels = 0;
    double seconds = 0;  // to build it in this frame; 0 if it already existed

    bool operator==(const BandFigures&) const = default;
};

// Statistics of a frame (see `--stats`).
struct FrameFigures {
    std::uint64_t born = 0, died = 0, collisions = 0;
    std::uint64_t contact_limit = 0;     // points that reached the limit of contacts in a step
    std::uint64_t beyond_tolerance = 0;  // points, including those that need more than max_substeps
    std::uint64_t trapped = 0;           // points deep in a shape, beyond its distance field
    int substeps = 0;
    double penetration_max = 0;
    double constraint_residual_max = 0;  // m
    ContactEnergy contact_energy;
    std::optional<Ledger> ledger;         // of constrained points
    std::uint64_t constraint_rows = 0;    // active at the end of the frame
    std::uint64_t loose_constraints = 0;  // active rows with an error above a tenth of their size
    std::uint64_t broken = 0;             // rods and springs that broke in the frame
    std::uint64_t asleep = 0;             // sleeping points at the end of the frame
    std::optional<Residual::Search> contact_search;
    std::vector<BandFigures> bands;  // of the collide nodes with a level set
    // Estimated position errors, m: since birth, for a sample of the points or all of them; and errors made in this
    // frame alone (coupled_errors.h). left_out_of_errors lists influences that neither includes.
    std::vector<double> errors, frame_errors;
    std::vector<std::string> left_out_of_errors;
    // Energy drift due to the integrator for each sample point since its birth, J/kg. has_no_energy: it is undefined,
    // because of drag, scripts or couplings.
    std::vector<double> energy_drift;
    bool has_no_energy = false;
    std::vector<Stiffness> stiff;
    double script_seconds = 0, solve_seconds = 0;
    double rounding = 0;     // m, the largest displacement of a sample point by rounding of positions
    Resolution resolution;   // for a trial (Evaluator::examine)
    std::uint64_t idle = 0;  // in a trial: emitters that have emitted nothing so far

    // Adds the next part of the frame: counts add up, maxima stay, and the later part gives the state at the end.
    void append(FrameFigures later);
};

}  // namespace rapid

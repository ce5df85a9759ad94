// The statistics of a frame, by the table of figure_table.h, and the types of those that are not numbers: what solve()
// and nodes count, and what `rapid run --stats` and a run's summary report.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/solver/figure_table.h"
#include "runtime/solver/ledger.h"

namespace rapid {

// Wall time by stage, s; the total of a frame is their sum. Frames are written while later ones are computed, so that
// the totals of all frames may exceed the time of the run.
struct StageSeconds {
    double graph = 0;   // nodes and parameters: all except the following
    double script = 0;  // kernels
    double solve = 0;
    double write = 0;

    double total() const { return graph + script + solve + write; }
    StageSeconds& operator+=(const StageSeconds& other);
};

// The energy that contacts add to points and remove from them, J, for the audit of a method (numerics.md, Collision):
// kinetic energy plus the potential energy of each substep's constant acceleration. A contact with a shape at rest adds
// none: any gain is the work of moving shapes, or the error of a method.
struct ContactEnergy {
    double added = 0, lost = 0;  // each summed over points and substeps

    void take(double change) { (change > 0 ? added : lost) += std::abs(change); }
    ContactEnergy& operator+=(const ContactEnergy& other);
};

// A statistic of a sample of points: the value of each point while the frame is computed, then their summary.
template <class Summary>
struct Sampled {
    std::vector<double> values;
    bool is_defined = true;  // for each of the points
    std::optional<Summary> summary = {};

    Sampled& operator+=(const Sampled& other)
    {
        values.insert(values.end(), other.values.begin(), other.values.end());
        is_defined &= other.is_defined;
        return *this;
    }
    void summarise()
    {
        if (is_defined && !values.empty()) summary = Summary::of(std::move(values));
        values.clear();
    }
};

// Estimated position errors, m, of a sample of the points or of all (coupled_errors.h).
struct ErrorQuantiles {
    double p50 = 0, p95 = 0, max = 0;

    static ErrorQuantiles of(std::vector<double> errors);
};

// Changes of kinetic energy by the integrator since birth, J/kg: the mean, and the largest magnitude. They are not
// defined under drag, scripts or couplings (energy_drift.h).
struct DriftSummary {
    double mean = 0, max = 0;

    static DriftSummary of(const std::vector<double>& drifts);
};

// The grids of the contact search.
struct ContactGrids {
    std::vector<std::size_t> points;  // number in each, from coarse to fine
    double error = 0, excess = 0;     // of their cells (RadiusGrids)
    double search_seconds = 0;
};

// The narrow band of a level set, as the collisions of a frame need it (paper §4.3).
struct BandFigures {
    std::string node;
    double width = 0;  // m, on each side of the surface
    std::uint64_t voxels = 0;
    double seconds = 0;  // to build it in this frame; 0 if it already existed
};

// Cost of one pass of a frame: of a node, or of fused neighbours.
struct NodeWork {
    enum class Stage { Graph, Script, Solve };
    std::vector<std::string> nodes;  // names, in the order of the chain
    Stage stage = Stage::Graph;      // Script: kernels
    double begin = 0, seconds = 0;   // s, wall time since advance() began, and duration
    std::uint64_t points = 0;        // of the result
    std::uint64_t bytes = 0;         // of its columns; shared columns count in each
};

// A stiff force or action (estimate/stiffness.h).
struct Stiffness {
    enum Kind {
        Drag,         // k dt, solved exactly
        Spring,       // omega dt, solved exactly
        SquaredDrag,  // c v dt
        Decay,        // k dt
        Oscillation,  // omega dt
    };

    std::string node;  // drag1; action "sun"
    Kind kind = Drag;
    double step = 0;         // the product that `kind` names, for the stiffest point
    int substeps = 1;        // of the frame
    std::int64_t frame = 0;  // in which it was found

    // The largest position errors of the sample after this frame, m, with the current and with more substeps. Empty
    // for parts that are solved exactly, and for coupled points, because a sample alone moves differently.
    struct Improvement {
        double error;
        int substeps;
        double error_after;
    };
    std::optional<Improvement> improvement;

    // For a kind that is solved exactly: everything that acts on the points is, so their motion is exact, too.
    bool alone = false;

    bool is_exact() const { return kind == Drag || kind == Spring; }
};

struct FrameFigures {
#define RAPID_FIGURE(type, name, ...) type name{};
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE

    // Adds the statistics of points that are advanced side by side with those so far.
    void add(const FrameFigures& other);
    // Adds those of the next subframe.
    void append(const FrameFigures& later);
};

}  // namespace rapid

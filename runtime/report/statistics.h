// What a run did and what it cost, frame by frame and in all: the summary, and the file that --stats writes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/evaluate.h"

namespace rapid {

// Wall time by stage, s. Their sum is the frame's total; writing runs beside the computation of later frames, so the
// totals of all frames may exceed the run's own time.
struct StageSeconds {
    double graph = 0;   // nodes and parameters: all that is not below
    double script = 0;  // kernels
    double solve = 0;
    double write = 0;

    double total() const { return graph + script + solve + write; }
    StageSeconds& operator+=(const StageSeconds& other);
};

struct FrameStatistics {
    std::int64_t frame = 0;
    std::uint64_t points = 0;  // of all outputs
    std::uint64_t born = 0, died = 0, collisions = 0;
    std::uint64_t contact_limit = 0, trapped = 0;  // points that Solve warned of (FrameFigures)
    int substeps = 0;
    // Estimated errors of the positions, m, accumulated since birth, of a sample of the points; nothing where none was
    // solved.
    struct Error {
        double p50, p95, max;
    };
    std::optional<Error> error;
    // By how much the integrator has changed the energies of motion of that sample since birth, J/kg: on average, and
    // at most, whichever way. Nothing where such an energy is not defined (energy_drift.h).
    struct EnergyDrift {
        double mean, max;
    };
    std::optional<EnergyDrift> energy_drift;
    std::uint64_t beyond_tolerance = 0;
    double penetration_max = 0;  // m
    ContactEnergy contact_energy;
    std::vector<BandFigures> bands;
    double constraint_residual_max = 0;   // m; 0 where nothing is constrained
    std::uint64_t constraint_rows = 0;    // that were active at the frame's end
    std::uint64_t loose_constraints = 0;  // of them, those that were off by more than a tenth of their size
    std::uint64_t asleep = 0;             // points, at the frame's end
    std::optional<Residual::Search> contact_search;
    StageSeconds seconds;
};

// The writing is not known yet: it has not happened.
FrameStatistics statistics_of(const FrameResult& result);

struct RunStatistics {
    std::string graph;  // as the user named it
    int threads = 1;
    std::uint64_t peak_bytes = 0;
    double seconds = 0;  // wall time from loading the graph to the last file
    std::vector<FrameStatistics> frames;
    std::vector<Stiffness> stiff;  // the worst of each node

    StageSeconds by_stage() const;
    std::uint64_t point_frames() const;  // the sum of all frames' points
};

// One frame a line. A run that ended early has the frames that it did.
std::string to_json(const RunStatistics& run);

// Points, frames, seconds by stage, memory: a line each; and one for what is stiff and what Solve warned of.
std::string summary(const RunStatistics& run);

// A line for each that is stiff.
std::string advice(const std::vector<Stiffness>& stiff);

// Numbers as people read them: "1,234,567", "3.21 million", "85.2 MiB", "0.042 s", "2 min 05 s".
std::string with_separators(std::uint64_t count);
std::string in_millions(double count);
std::string memory_text(std::uint64_t bytes);
std::string duration_text(double seconds);

}  // namespace rapid

// The statistics of a run, by frame and in total: the summary, and the file that --stats writes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/evaluate.h"

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

struct FrameStatistics {
    std::int64_t frame = 0;
    std::uint64_t points = 0;  // of all outputs
    std::uint64_t born = 0, died = 0, collisions = 0;
    std::uint64_t contact_limit = 0, trapped = 0;  // points of which Solve warns (FrameFigures)
    int substeps = 0;
    // Estimated position errors, m: accumulated since birth, and of this frame alone; nothing if none were estimated.
    // Also the contributions that neither includes, as text.
    struct Error {
        double p50, p95, max;
    };
    std::optional<Error> error, frame_error;
    std::vector<std::string> left_out_of_errors;
    double rounding = 0;  // m, largest displacement of a sampled point since birth by rounding of positions
    // Change of the sample's kinetic energy by the integrator since birth, J/kg: the mean, and the largest magnitude.
    // Nothing if the energy is not defined (energy_drift.h).
    struct EnergyDrift {
        double mean, max;
    };
    std::optional<EnergyDrift> energy_drift;
    std::uint64_t beyond_tolerance = 0;
    double penetration_max = 0;  // m
    ContactEnergy contact_energy;
    std::optional<Ledger> ledger;
    std::vector<BandFigures> bands;
    double constraint_residual_max = 0;   // m; 0 if nothing is constrained
    std::uint64_t constraint_rows = 0;    // active at the frame's end
    std::uint64_t loose_constraints = 0;  // those with an error above a tenth of their size
    std::uint64_t broken = 0;             // rods and springs that broke in the frame
    std::uint64_t asleep = 0;             // sleeping points at the frame's end
    std::optional<Residual::Search> contact_search;
    StageSeconds seconds;
    // Time of each pass, in order; sub-frames are added up, except points and bytes, which are those of the last one.
    struct Node {
        std::vector<std::string> nodes;  // names: one, or neighbours that processed the points together
        double seconds;                  // of the wall, s
        std::uint64_t points, bytes;     // of the result
    };
    std::vector<Node> nodes;
};

// Returns the statistics without the time of writing, which is known later.
FrameStatistics statistics_of(const FrameResult& result);

struct RunStatistics {
    std::string graph;  // as the user named it
    int threads = 1;
    std::uint64_t peak_bytes = 0;
    double seconds = 0;            // wall time from loading the graph to the last file
    std::vector<Stiffness> stiff;  // the worst of each node
};

// Parts of a statistics file, in the order in which a run knows them: its head; a line for each frame, after that of
// the previous one; and the totals at the end. A run that ended early has the frames that it completed.
std::string json_head(const RunStatistics& run);
std::string json_line(const FrameStatistics& frame, bool first);
std::string json_end(const RunStatistics& run);

// Returns a line each for points, frames, seconds by stage, memory, errors and other figures; and one for each stiff
// node and each warning of Solve.
class RunTotals;
std::string summary(const RunStatistics& run, const RunTotals& totals);

// Returns a line for each stiff node.
std::string advice(const std::vector<Stiffness>& stiff);

}  // namespace rapid

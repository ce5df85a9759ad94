// Keeps what happens to the points in a step, where an emitter has the simulation as its source (StepRecord).
#pragma once

#include <optional>
#include <span>

#include "runtime/graph/simulation.h"
#include "runtime/solver/solve.h"

namespace rapid {

class StepRecorder {
public:
    // Does nothing where the simulation has no record.
    explicit StepRecorder(Simulation& simulation) : simulation_(simulation), record_(simulation.record.get()) {}

    // The initial state, before any dynamics.
    void start(const PointSet& points);
    // Before the step. Without contacts: the log is not asked for.
    void begin(const PointSet& points, SolveOptions& options, bool has_contacts);
    // After it, before points of old age are removed.
    void end();
    // The points whose mask is 0 have reached the end of their lives.
    void remove_old(const PointSet& points, std::span<const std::uint8_t> stays);

private:
    Simulation& simulation_;
    StepRecord* record_;
    std::optional<StepLog> log_;
};

}  // namespace rapid

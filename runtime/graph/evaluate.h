// Runs a plan, frame by frame.
//
// At each frame the nodes are evaluated in the order of the plan. A result goes to its last reader without a copy. A
// result that never changes is computed once. Neighbouring edits are fused into one pass. At the first frame the nodes
// between Create and Solve do not run. With subframes, the nodes upstream of a Solve are evaluated once per subframe,
// and those after it once, at the end of the frame.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/stopwatch.h"
#include "runtime/graph/plan.h"
#include "runtime/points/saved_state.h"

namespace rapid {

// The state of a run between two frames: another evaluator of the same graph continues from it with bit-identical
// results.
struct Snapshot {
    std::int64_t frame = 0;                         // the last computed frame
    std::map<std::string, SavedState> simulations;  // by the name of the Create
    std::map<std::string, SavedState> nodes;        // of stateful nodes, by name
    std::map<std::string, SavedState> constants;    // points of merges whose result never changes, by name

    std::size_t size() const;  // bytes
    bool operator==(const Snapshot&) const = default;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(frame, simulations, nodes, constants);
    }
};

class ChangingNode;

struct FrameResult {
    std::int64_t frame = 0;
    std::map<std::string, PointSet> outputs;
    std::map<std::string, double> fps;  // of each output's simulation
    std::map<std::string, double> time;
    std::map<std::string, std::vector<StepRecord>> steps;  // for each Create with a Solve, if the plan keeps them
    FrameFigures figures;
    std::vector<NodeWork> work;  // in order; one entry per node and subframe
    std::chrono::steady_clock::time_point began = {};
    double total_seconds = 0;  // wall time, without writing
    std::vector<std::string> warnings;
};

class Evaluator {
public:
    // Receives the sets that `:write` nodes write, with the frame of the node's simulation; empty if nothing may be
    // written.
    using WriteHook =
        std::function<void(const std::string& pattern, const PointSet& points, const Frame& frame, double fps)>;

    // Receives the result of each node.
    using ResultHook = std::function<void(const Node& node, std::int64_t frame, const PointSet& points)>;

    // Receives the flow that enters each node (without inputs: none), after its functions of the frame have been
    // called.
    using InputHook = std::function<void(const Node& node, const Frame& frame, std::span<const Flow> inputs)>;

    explicit Evaluator(const Plan& plan, WriteHook write = {}, ResultHook result = {});
    ~Evaluator();

    // Enables the checked mode: each node finds poison in everything that it has not declared, and processes the
    // points by itself. Slower, for tests (attribute_uses.h). advance() then throws Error if a node's declaration
    // is incomplete.
    void check_declarations() { checks_declarations_ = true; }

    // Disables error estimates, which take up to twice the time of Solve, for runs that do not report them. With a
    // tolerance, the results are identical.
    void disable_error_estimates();
    // Adds the attributes of PointFigures to points after a Solve: each point's estimated error, substeps and sleep
    // state. They are meant for inspection, and nodes after a Solve see them, too.
    void add_per_point_diagnostics();

    // Makes `input` receive the flow that enters each node. Nodes are then evaluated one by one.
    void watch_inputs(InputHook input) { input_ = std::move(input); }

    // Returns the frame that advance() will compute.
    std::int64_t next_frame() const { return next_; }

    // Computes the next frame. The result shares its columns with the state: release it before the next call to avoid
    // a copy. Throws the Error of a node, with its name and location, or if the run is cancelled (Cancellation). The
    // evaluator cannot be used afterwards.
    FrameResult advance();

    // Examines stiffness and resolution in the first frame after the start, for a few newborn and the initial points,
    // which Solve does not move. If an emitter emits nothing in that frame, later ones are tried, at most max_tried
    // frames away: their points also go through the kernels. The evaluator cannot be used afterwards. Throws Error as
    // advance() does.
    Trial examine();

    // Returns the state that later frames depend on, after the last computed frame. Its columns are shared until
    // either side writes them.
    Snapshot save() const;
    // Continues from a snapshot of the same graph: the next frames are bit-identical to those of the evaluator that
    // made it. Throws Error if it is of another graph; the evaluator cannot be used afterwards.
    void load(const Snapshot& snapshot);

private:
    static constexpr std::int64_t max_tried = 64;  // frames after the start

    void evaluate_constants(const Snapshot& snapshot);
    bool adopts_once(std::size_t node) const;
    // Calls the functions of the frame, `left` subframes before its end.
    void call_functions(std::int64_t frame, int left);
    void take_columns();
    // Evaluates a subframe of the next frame, `left` subframes before its end. results: by node; readers: number of
    // readers of each result that have not taken it yet.
    void advance_subframe(int left, std::vector<Flow>& results, std::vector<std::size_t>& readers, FrameResult& frame);
    // Evaluates the nodes from first to last, which are fused if there are several (Plan::last_together). Returns the
    // last result.
    Flow evaluate(std::size_t first, std::size_t last, int left, std::vector<Flow>& results,
                  std::vector<std::size_t>& readers, FrameResult& frame);
    void add_work(std::size_t first, std::size_t last, double begin, double scripts_before, const PointSet& result,
                  FrameResult& frame) const;
    // Returns the uses that a node may have: for a Solve, including those of the dynamics upstream of it.
    std::vector<Uses> declared_for(std::size_t node) const;
    void edit_together(std::size_t first, std::size_t last, int left, PointSet& points, FrameResult& frame);
    // Removes the points condemned by emitters (Simulation::condemned).
    void remove_condemned(std::vector<Flow>& results, FrameFigures& figures);
    class Context;

    const Plan& plan_;
    WriteHook write_;
    ResultHook result_;
    InputHook input_;
    Stopwatch frame_clock_;  // since advance() began
    std::int64_t next_;
    int subframes_ = 1;  // of all simulations
    bool checks_declarations_ = false;
    std::vector<std::shared_ptr<Simulation>> simulations_;
    std::vector<std::optional<Flow>> constant_results_;    // results of nodes that are evaluated once, by node
    std::vector<std::unique_ptr<ChangingNode>> changing_;  // by node; null if no parameter is a function of the frame
};

}  // namespace rapid

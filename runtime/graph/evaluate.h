// Runs a plan, frame by frame.
//
// At each frame the nodes are evaluated in the order of the plan. A result goes to its last reader without a copy; a
// result that never changes is computed once; neighbouring edits are fused into one pass. At the first frame the nodes
// between Create and Solve do not run. With sub-frames, the nodes upstream of a Solve are evaluated once per sub-frame,
// and those after it once, at the end of the frame.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/stopwatch.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/snapshot.h"

namespace rapid {

class ChangingNode;

// What one pass of a frame took: of a node, or of neighbours that went over the points together.
struct NodeWork {
    enum class Stage { Graph, Script, Solve };
    std::vector<std::string> nodes;  // names, in the order of the chain
    Stage stage = Stage::Graph;      // Script: kernels
    double begin = 0, seconds = 0;   // s, wall time since advance() began, and how long
    std::uint64_t points = 0;        // of the result
    std::uint64_t bytes = 0;         // of its columns; those that it shares with others count in each
};

struct FrameResult {
    std::int64_t frame = 0;
    std::map<std::string, PointSet> outputs;
    std::map<std::string, double> fps;  // of each output's simulation
    std::map<std::string, double> time;
    std::map<std::string, std::vector<StepRecord>> steps;  // of each Create with a Solve, if the plan keeps them
    FrameFigures figures;
    std::vector<NodeWork> work;  // in order; of a node once for each sub-frame
    std::chrono::steady_clock::time_point began = {};
    double total_seconds = 0;  // wall time, without writing
    std::vector<std::string> warnings;
};

class Evaluator {
public:
    // Receives the sets that `:write` nodes write, with the frame of the node's simulation; empty where nothing may be
    // written.
    using WriteHook =
        std::function<void(const std::string& pattern, const PointSet& points, const Frame& frame, double fps)>;

    // Receives the result of each node.
    using ResultHook = std::function<void(const Node& node, std::int64_t frame, const PointSet& points)>;

    // Receives the flow that enters each node (no input: none), once its functions of the frame have been called.
    using InputHook = std::function<void(const Node& node, const Frame& frame, std::span<const Flow> inputs)>;

    explicit Evaluator(const Plan& plan, WriteHook write = {}, ResultHook result = {});
    ~Evaluator();

    // From now on each node finds poison in what it has not declared, and goes over the points by itself: slower, and
    // for tests (undeclared_columns.h). Error of advance(): a node whose declaration is too short.
    void check_declarations() { checks_declarations_ = true; }

    // From now on no errors are estimated, which takes up to twice the time of Solve: for runs that nobody asks for
    // them. With a tolerance they are all the same.
    void leave_out_errors();
    // From now on the points behind a Solve have the attributes of PointFigures: of each point the estimated error, the
    // sub-steps, whether it sleeps. For those who look at them; nodes behind a Solve see them, too.
    void tell_points();

    // From now on `input` is told what enters each node. Nodes are then evaluated one by one.
    void watch_inputs(InputHook input) { input_ = std::move(input); }

    // The frame that advance() will compute.
    std::int64_t next_frame() const { return next_; }

    // Computes the next frame. The result shares its columns with the state: release it before the next call to avoid a
    // copy. Error: of a node, with its name and location; what runs is cancelled (Cancellation). The evaluator can't be
    // used afterwards.
    FrameResult advance();

    // Stiffness and resolution in the first frame after the start, of a few newborn and the initial points, which Solve
    // does not move. If an emitter emits nothing in that frame, later ones are tried, at most most_tried away: their
    // points go through the kernels, too. The evaluator can't be used afterwards. Error: as advance().
    FrameFigures examine();

    // All that the next frames depend on, after the last one; its columns are shared until either side writes them.
    Snapshot save() const;
    // Goes on behind a snapshot of the same graph: the next frames are those of the evaluator that made it, to the bit.
    // Error: it is of another graph; the evaluator can't be used afterwards.
    void load(const Snapshot& snapshot);

private:
    static constexpr std::int64_t most_tried = 64;  // frames after the start

    void evaluate_constants(const Snapshot& snapshot);
    bool adopts_once(std::size_t node) const;
    // Calls the functions of the frame, `left` sub-frames before its end.
    void call_functions(std::int64_t frame, int left);
    void take_columns();
    // Evaluates a sub-frame of the next frame, `left` sub-frames before its end. results: by node; readers: of each
    // result, those that have not taken it yet.
    void advance_subframe(int left, std::vector<Flow>& results, std::vector<std::size_t>& readers, FrameResult& frame);
    // Evaluates the nodes from first to last: several if they are fused (Plan::last_together). Returns the last result.
    Flow evaluate(std::size_t first, std::size_t last, int left, std::vector<Flow>& results,
                  std::vector<std::size_t>& readers, FrameResult& frame);
    void add_work(std::size_t first, std::size_t last, double begin, double scripts_before, const PointSet& result,
                  FrameResult& frame) const;
    // What a node may use: for a Solve, also what the dynamics upstream of it do.
    std::vector<Uses> declared_for(std::size_t node) const;
    void edit_together(std::size_t first, std::size_t last, int left, PointSet& points, FrameResult& frame);
    // Takes the points away that emitters have condemned (Simulation::condemned).
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
    std::vector<std::optional<Flow>> kept_;  // results of nodes that are evaluated once, by node
    std::vector<std::unique_ptr<ChangingNode>>
        changing_;  // by node; null where no parameter is a function of the frame
};

}  // namespace rapid

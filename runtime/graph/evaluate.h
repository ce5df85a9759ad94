// Runs a plan, frame by frame.
//
// At each frame the nodes are evaluated in the order of the plan; a result goes to its last reader without a copy, and
// what never changes is evaluated once; neighbouring edits go over the points together. At the first frame the nodes
// between Create and Solve do not run. With sub-frames all that is upstream of a Solve is evaluated so many times a
// frame, and what comes after it once, at the frame's end.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

struct FrameResult {
    std::int64_t frame = 0;
    std::map<std::string, PointSet> outputs;
    std::map<std::string, double> fps;  // of each output's simulation
    std::map<std::string, double> time;
    FrameFigures figures;
    double total_seconds = 0;  // wall time, without writing
    std::vector<std::string> warnings;
};

class Evaluator {
public:
    // Hands on what `:write` nodes write; empty where nothing may be written. `frame` is the frame of that node's
    // simulation.
    using WriteHook =
        std::function<void(const std::string& pattern, const PointSet& points, const Frame& frame, double fps)>;

    // Told of each node's result.
    using ResultHook = std::function<void(const Node& node, std::int64_t frame, const PointSet& points)>;

    explicit Evaluator(const Plan& plan, WriteHook write = {}, ResultHook result = {});

    // From now on each node finds poison in what it has not declared, and goes over the points by itself: slower, and
    // for tests (undeclared_columns.h). Error of advance(): a node whose declaration is too short.
    void check_declarations() { checks_declarations_ = true; }

    // The frame that advance() will compute.
    std::int64_t next_frame() const { return next_; }

    // Computes the next frame. The result shares its columns with the state: let go of it before the next call, where a
    // copy is to be avoided. Error: whatever a node throws, with its name and place; the evaluator is then at its end.
    FrameResult advance();

    // What is stiff in the first frame after the start, of a few births and the initial points, which Solve leaves
    // where they are. Nothing else is done with the evaluator then. Error: as advance().
    std::vector<Stiffness> try_out();

private:
    // A step of the next frame, `left` steps before its end. The results of the nodes, and who has not read them yet.
    void take(int left, std::vector<Flow>& results, std::vector<std::size_t>& readers, FrameResult& frame);
    // The nodes from first to last: several where they go together (Plan::last_together). The result of the last.
    Flow evaluate(std::size_t first, std::size_t last, int left, std::vector<Flow>& results,
                  std::vector<std::size_t>& readers, FrameResult& frame);
    // What a node may use: for a Solve, also what the dynamics upstream of it do.
    std::vector<Uses> declared_for(std::size_t node) const;
    void edit_together(std::size_t first, std::size_t last, int left, PointSet& points, FrameResult& frame);
    class Told;

    const Plan& plan_;
    WriteHook write_;
    ResultHook result_;
    std::int64_t next_;
    int subframes_ = 1;  // of all simulations
    bool checks_declarations_ = false;
    std::vector<std::shared_ptr<Simulation>> simulations_;
    std::vector<std::optional<Flow>> kept_;  // results of nodes that are evaluated once
};

}  // namespace rapid

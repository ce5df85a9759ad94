// A dynamic node with parameters that are functions of the frame: provides its effect at any time of a step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/frame.h"
#include "runtime/graph/param.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/value.h"
#include "runtime/solver/changing.h"

namespace rapid {

// Interpolates a function of the frame between frames: it is called only at the ends of steps (numerics.md, Functions
// of the frame).

// Returns a polynomial through values at consecutive integers, starting at `first`, evaluated at x. `used`: number of
// values, those nearest to the interval from 0 to 1.
double interpolated(std::span<const double> values, int first, std::size_t used, double x);

// Returns true if the values follow no curve: their highest difference, which decreases with the order for a smooth
// curve, is more than half of the largest first difference.
bool jumps(std::span<const double> values);

class FrameCurve {
public:
    // function: of a parameter whose values may be numbers. Both arguments must outlive this.
    FrameCurve(const Param& param, const FrameFunction& function) : param_(param), function_(function) {}

    const Param& param() const { return param_; }

    // Calls the function at the steps around the one that ends at `step`, unless their values are known.
    void move_to(std::int64_t step, const FrameClock& clock);

    // Returns true if the values change within the step.
    bool changes() const { return changes_; }

    // Returns the value at a part of the step, from 0 to 1. finer: uses one more value, so that the difference
    // estimates the error; for values that jump, uses the one at the end of the step. Other values than numbers are
    // those at the end of the step; with finer, those at the beginning in the first half.
    Value at(double part, bool finer) const;

private:
    const Param& param_;
    const FrameFunction& function_;
    std::map<std::int64_t, Value> known_;      // by step
    std::vector<std::vector<double>> values_;  // by coordinate, at consecutive steps
    int first_ = 0;                            // step of the first value: 0 is the beginning of the step
    bool changes_ = false;
    Value begin_, end_;
};

class ChangingNode {
public:
    // Treatment of a parameter's numbers between the calls of its function.
    enum class Between {
        Interpolated,  // functions of time
        Held,          // as at the end of the step; the error estimate includes the deviation
        Unfollowed,    // as at the end of the step, or handled by the node; not in the error estimate
    };
    static Between between_calls(const Node& node, const Param& param);

    // Both must outlive this.
    ChangingNode(const PlannedNode& planned, std::shared_ptr<Simulation> simulation);

    // Is called after the node's evaluation. Makes the entry that the node added last to the chain available at all
    // times of the step, if its numbers change. before: size of the chain without it.
    void follow(Dynamics& dynamics, std::size_t before, const Evaluation& now);

    // Returns the parameters whose changes within a step `follow` ignores.
    static std::vector<std::string> ignored_changes(const Node& node);

private:
    template <class D>
    std::shared_ptr<const D> at(double part, bool finer, const Evaluation& now);
    template <class D>
    AtPart<D> at_part(const Evaluation& now);
    void assign(double part, bool finer);

    const PlannedNode& planned_;
    std::shared_ptr<Simulation> simulation_;
    std::vector<FrameCurve> curves_;
};

}  // namespace rapid

// A dynamic node with parameters that are functions of the frame: what it adds to the chain at any time of a step.
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

// What a function of the frame gives between frames: it is called at the ends of steps alone, and its numbers are
// interpolated (numerics.md, Functions of the frame).

// A polynomial through values at whole places from `first` on, at the place x. `used`: so many of them, those nearest
// to the interval from 0 to 1.
double interpolated(std::span<const double> values, int first, std::size_t used, double x);

// Whether values follow no curve: their highest difference, which falls by the order where they do, is more than half
// of the largest first one.
bool jumps(std::span<const double> values);

class FrameCurve {
public:
    // function: of a parameter whose values may be numbers, which both outlive this.
    FrameCurve(const Param& param, const FrameFunction& function) : param_(param), function_(function) {}

    const Param& param() const { return param_; }

    // Calls the function at the steps around the one that ends at `step`, as far as they are not known.
    void move_to(std::int64_t step, const FrameClock& clock);

    // Whether the values in the step differ.
    bool changes() const { return changes_; }

    // The value at a part of the step, from 0 to 1. finer: by one more value, so that the difference tells the error;
    // of a jump, the value at its end throughout. What is no number is as at the end of the step; finer, in the first
    // half of it as at the beginning.
    Value at(double part, bool finer) const;

private:
    const Param& param_;
    const FrameFunction& function_;
    std::map<std::int64_t, Value> known_;      // by step
    std::vector<std::vector<double>> values_;  // of each coordinate, at consecutive steps
    int first_ = 0;                            // of the values: 0 is the beginning of the step
    bool changes_ = false;
    Value begin_, end_;
};

class ChangingNode {
public:
    // What becomes of the numbers of a parameter between the calls of its function.
    enum class Between {
        Interpolated,  // functions of time
        Held,          // as at the end of the step; what that is off by is in the error
        Unfollowed,    // as at the end of the step, or the node's own affair; in no error
    };
    static Between between_calls(const Node& node, const Param& param);

    // Both outlive this.
    ChangingNode(const PlannedNode& planned, std::shared_ptr<Simulation> simulation);

    // After its evaluation: what it has added to the chain last can then be had at all times of the step, where numbers
    // change in it. before: the size of the chain without it.
    void follow(Dynamics& dynamics, std::size_t before, const Evaluation& now);

    // The parameters whose changes within a step are in none of the results of `follow`.
    static std::vector<std::string> not_followed(const Node& node);

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

// A dynamic node with parameters that are functions of the frame: what it adds to the chain at any time of a step.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "runtime/graph/frame_curve.h"
#include "runtime/graph/plan.h"
#include "runtime/solver/changing.h"

namespace rapid {

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

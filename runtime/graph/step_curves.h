// Curves that move or deform during one step, as the value of a force's parameter. They are created in advance on the
// calling thread, when functions of the frame are called (step_shape.h).
#pragma once

#include "runtime/base/frame.h"
#include "runtime/shapes/motion/curves.h"

namespace rapid {

class StepCurves final : public Object {
public:
    // The type of a parameter that accepts one.
    static constexpr std::string_view param_type = "list of vec3, points, or curve";
    std::string_view kind() const override { return "moving curve"; }

    // cubics: of each point, over the step. begin: of the step, s since the start of the simulation. lines: null if
    // there is no curve in this step.
    StepCurves(std::shared_ptr<const CurveLines> lines, std::vector<Cubic<Vec3d>> cubics, double begin, double duration)
        : lines_(std::move(lines)), cubics_(std::move(cubics)), begin_(begin), duration_(duration)
    {
    }

    const std::shared_ptr<const CurveLines>& lines() const { return lines_; }
    // Returns the points and their velocities, m/s, at a time since the start, s.
    void at(double time, std::vector<Vec3d>& P, std::vector<Vec3d>& v) const;

private:
    std::shared_ptr<const CurveLines> lines_;
    std::vector<Cubic<Vec3d>> cubics_;
    double begin_, duration_;  // s; 0 at the start, at which nothing moves
};

// Returns null for any other object. Throws the Error of a motion, a script, or a file of a sequence.
std::shared_ptr<const StepCurves> step_curves(const ObjectPtr& object, const FrameClock& clock, const Frame& frame);

}  // namespace rapid

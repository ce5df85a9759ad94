// The value of a curve in a graph: a list of positions, points, or a function of the frame that returns either.
#pragma once

#include <string>

#include "runtime/graph/param.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/motion/curves.h"

namespace rapid {

// Returns the curve through points in order; if they have the attribute `curve` (io/obj.cpp), one curve per run of its
// values. Floats and vectors of the points become values of the curve. closed: the last point is joined to the first,
// which may have the same position. Throws Error as Curves does.
CurvesPtr curves_of(const PointSet& points, bool closed, const std::string& name);

struct CurveValue {
    static constexpr std::string_view param_type = "list of vec3, points, or function of the frame";

    PointSet points;                                // if it is not a function
    std::shared_ptr<const FrameFunction> function;  // null if it is not a function

    // Returns a Curves, or a MovingCurves: a function is called for frame 1 immediately, and later at whole frames.
    // Throws Error as curves_of() does, or if a function returns anything else, or another number of points than at
    // first.
    ObjectPtr curves(bool closed) const;
};
void read_value(const Param& param, const Value& value, CurveValue& field);

}  // namespace rapid

// What a curve is made of in a graph: a list of places, points, or a function of the frame that returns either.
#pragma once

#include <string>

#include "runtime/graph/param.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/motion/curves.h"

namespace rapid {

// Through points in their order; where they have the attribute `curve` (io/obj.cpp), one for each run of its values.
// Floats and vectors of the points are values of the curve. closed: from the last point to the first, which may be the
// same place. Error: as Curves.
CurvesPtr curves_of(const PointSet& points, bool closed, const std::string& name);

struct CurveValue {
    static constexpr std::string_view param_type = "list of vec3, points, or function of the frame";

    PointSet points;                                // where it is no function
    std::shared_ptr<const FrameFunction> function;  // null where it is none

    // A Curves, or a MovingCurves: a function is called for frame 1 at once, and then at whole frames. Error: as
    // curves_of(); a function that returns something else, or another number of points than at first.
    ObjectPtr curves(bool closed) const;
};
void read_value(const Param& param, const Value& value, CurveValue& field);

}  // namespace rapid

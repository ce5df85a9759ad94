// A point set as a value in a graph: rapid.points.read, .grid, .from.
#pragma once

#include "runtime/object.h"
#include "runtime/points/point_set.h"

namespace rapid {

class PointsObject : public Object {
public:
    static constexpr std::string_view param_type = "points";
    std::string_view kind() const override { return "points"; }

    PointSet points;
};

}  // namespace rapid

// What points go to: a mesh, a shape or points, at rest or moving, or a place of each point's own.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/graph/param.h"
#include "runtime/graph/points_object.h"
#include "runtime/graph/value.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// The number of the place that a point has taken (by = "nearest", of points); -1: none.
inline constexpr char goal_number[] = "goalnum";

struct GoalTarget {
    static constexpr std::string_view param_type = "mesh, shape, points or rapid.attr";

    ObjectPtr object;       // null: the attribute
    std::string attribute;  // a vec3

    bool is_points() const;
    // Whether a point keeps the place that it has once got, by number.
    bool is_taken(const std::string& by) const { return is_points() && by == "nearest"; }
};

void read_value(const Param& param, const Value& value, GoalTarget& target);

// The places of a target as it is at the end of a frame.
class GoalPlaces {
public:
    // by: "id", "random" or "nearest". Error: a target that has no places of that kind.
    GoalPlaces(const GoalTarget& target, const std::string& by);
    ~GoalPlaces();
    GoalPlaces(GoalPlaces&&) noexcept;
    GoalPlaces& operator=(GoalPlaces&&) noexcept;

    // places: shape [points.size()], of those whose member is 1. The points get their goal_number where they take a
    // place.
    void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock& clock, const Evaluation& now,
              std::span<Vec3f> places);

private:
    class Kind;
    class OfPoints;
    class OfMesh;
    class OfShape;
    std::unique_ptr<Kind> kind_;
};

}  // namespace rapid

// The target of points: a mesh, a shape or points, at rest or moving, or a position stored per point.
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

// The index of the position that a point has taken (by = "nearest", for points); -1: none.
inline constexpr char goal_number[] = "goalnum";

struct GoalTarget {
    static constexpr std::string_view param_type = "mesh, shape, points or rapid.attr";

    ObjectPtr object;       // null: the attribute
    std::string attribute;  // a vec3

    bool is_points() const;
    // Returns true if a point keeps the position that it first took, by index.
    bool is_taken(const std::string& by) const { return is_points() && by == "nearest"; }
};

void read_value(const Param& param, const Value& value, GoalTarget& target);

// The positions of a target at the end of a frame.
class GoalPositions {
public:
    // by: "id", "random" or "nearest". Throws Error if the target has no positions of that kind.
    GoalPositions(const GoalTarget& target, const std::string& by);
    ~GoalPositions();
    GoalPositions(GoalPositions&&) noexcept;
    GoalPositions& operator=(GoalPositions&&) noexcept;

    // Finds the positions of points whose member is 1; positions: shape [points.size()]. Stores goal_number if points
    // take a position.
    void find(PointSet& points, Strided<std::uint8_t> members, const FrameClock& clock, const Evaluation& now,
              std::span<Vec3f> positions);

private:
    class Kind;
    class OfPoints;
    class OfMesh;
    class OfShape;
    std::unique_ptr<Kind> kind_;
};

}  // namespace rapid

// The target of points: a mesh, a shape or points, at rest or moving, or a position stored per point.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/graph/param.h"
#include "runtime/graph/points_object.h"
#include "runtime/graph/value.h"
#include "runtime/math/vec.h"
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

// Positions that points take one by one, each the nearest of those with the fewest takers. All are taken once before
// any is taken twice.
//
// A k-d tree stored in an array: the middle of a range is a node, the elements before and after it are its two
// branches. Each node stores how many positions in its range are free.
class FreePositions {
public:
    // positions: finite, at least one. occupancy: current number of takers of each.
    FreePositions(std::vector<Vec3d> positions, std::vector<std::uint32_t> occupancy);

    // Returns the index of the free position nearest to P, and takes it; ties go to the first. Any is taken if P is
    // not finite.
    std::uint32_t take(const Vec3d& P);

private:
    struct Nearest {
        double distance2;
        std::size_t node;
    };
    void build(std::size_t begin, std::size_t end);
    std::size_t count_free(std::size_t begin, std::size_t end);
    void search(std::size_t begin, std::size_t end, const Vec3d& P, Nearest& nearest) const;

    std::vector<Vec3d> positions_;
    std::vector<std::uint32_t> occupancy_;
    std::uint32_t round_ = 0;           // the lowest number of takers
    std::vector<std::uint32_t> order_;  // indices of positions, in tree order
    std::vector<std::uint8_t> axis_;    // along which a node splits its range
    std::vector<std::uint32_t> free_;   // number of positions in a node's range with the fewest takers
};

}  // namespace rapid

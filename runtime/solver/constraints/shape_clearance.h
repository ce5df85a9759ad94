// Which points may be near shapes: by lower bounds of their distances, so that most points are not asked about at each
// sub-step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// The points of a chunk, and those whose distance from a shape is asked. Kept for its memory.
struct ShapeQuery {
    std::span<const Vec3d> free;             // where the points' free motion has ended
    std::size_t begin = 0;                   // the chunk's first point
    double since = 0;                        // s, from the beginning of the frame to the end of the sub-step
    std::vector<std::uint32_t> open;         // points that may be near some shape
    std::vector<double> moved, since_asked;  // m, in this sub-step, and since distances were first asked; by chunk

    std::vector<std::uint32_t> asked;  // points, of one shape
    std::vector<Vec3d> P, gradient;    // of these
    std::vector<double> phi, time;     // m, s

    // How far a point may come in a sub-step, m: a contact that is farther is left out.
    double reach(const Obstacle& obstacle, std::size_t i) const;
};

class ShapeClearance {
public:
    ShapeClearance(std::span<const Obstacle> obstacles, std::size_t size);

    // Lists the open points from `begin` to `end`.
    void open(ShapeQuery& query, const Substep& step, std::size_t end);
    // Asks one shape about those that may be near it, and keeps their distances.
    void ask(ShapeQuery& query, std::size_t obstacle, const Substep& step);
    // When all shapes have been asked: what is left open.
    void close(const ShapeQuery& query, std::size_t obstacle);
    void begin(std::span<const Vec3d> free);

private:
    void list(ShapeQuery& query, std::size_t obstacle, const Substep& step);

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    bool any_moves_;
    std::vector<float> clearance_;  // m, [obstacles, size]: the point was at least so far from it at asked_at_
    std::vector<Vec3d> asked_at_;
    std::vector<float> room_;  // m: as far a point may move, and be pushed, before it can be near any of them
};

}  // namespace rapid

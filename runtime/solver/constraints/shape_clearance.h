// Finds points that may be near shapes from lower bounds of their distances, so that most points need no query in a
// substep.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Query of a chunk's points for their distances from a shape. Reused to keep its memory.
struct ShapeQuery {
    std::span<const Vec3d> free;             // positions after the points' free motion
    std::size_t begin = 0;                   // the chunk's first point
    double since = 0;                        // s, from the beginning of the frame to the end of the sub-step
    std::vector<std::uint32_t> open;         // points that may be near some shape
    std::vector<double> moved, since_asked;  // m, in this substep, and since distances were first queried; by chunk

    std::vector<std::uint32_t> asked;  // points queried for one shape
    std::vector<Vec3d> P, gradient;    // of the queried points
    std::vector<double> phi, time;     // m, s

    // Returns the distance that a point may move in a substep, m. Contacts that are farther away are skipped.
    double reach(const Obstacle& obstacle, std::size_t i) const;
};

class ShapeClearance {
public:
    ShapeClearance(std::span<const Obstacle> obstacles, std::size_t size);

    // Lists the open points from `begin` to `end`.
    void open(ShapeQuery& query, const Substep& step, std::size_t end);
    // Queries one shape for the points that may be near it, and stores their distances.
    void ask(ShapeQuery& query, std::size_t obstacle, const Substep& step);
    // Closes the query after all shapes.
    void close(const ShapeQuery& query, std::size_t obstacle);
    void begin(std::span<const Vec3d> free);

private:
    void list(ShapeQuery& query, std::size_t obstacle, const Substep& step);

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    bool any_moves_;
    std::vector<float> clearance_;  // m, [obstacles, size]: lower bound of the distance at asked_at_
    std::vector<Vec3d> asked_at_;
    std::vector<float> room_;  // m: distance that a point may move or be pushed without coming near any of them
};

}  // namespace rapid

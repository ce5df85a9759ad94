// Shapes as rows of the projection: they keep out points that other constraints push into them.
//
// A point's own way has been taken around all shapes before (collide.h); what is left to a shape here is what the other
// points press on it: along the normal, and with Coulomb's friction of that. A row is C = n·x - level >= 0, the shape's
// tangent plane where the point's free way ended; at the end of the sub-step the exact distance has the last word.
//
// The impulses of a sub-step are where the next one begins, across frames too: a pile at rest is then solved before it
// is iterated.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// What the shapes bore at the end of a frame, for the next one to begin with.
struct ShapeLoads {
    struct Load {
        std::int64_t id;
        std::uint32_t obstacle;
        float normal;   // N
        Vec3f tangent;  // N
    };
    std::vector<Load> loads;
};

class ShapeContacts {
public:
    ShapeContacts(std::span<const Obstacle> obstacles, std::size_t size);

    void recall(const ShapeLoads& loads, const Column<std::int64_t>& ids, double dt);
    void remember(ShapeLoads& loads, const Column<std::int64_t>& ids, double dt) const;

    // free: where the points' free ways have ended; `now.at` may be there already, or beyond.
    void prepare(Substep& now, std::span<const Vec3d> free);
    void project(Substep& now);
    void settle(Substep& now);

private:
    struct Row {
        std::uint32_t i, obstacle;
        Vec3d n, vc;                   // unit normal out of the shape; its velocity, m/s
        double level;                  // m: on the shape's outer side n·x is more
        double friction;               // μ
        double pressed;                // N s along n, by positions
        double held;                   // N s along n, by velocities
        Vec3d rubbed = Vec3d::Zero();  // N s along the surface
    };
    using Batch = std::vector<Row>;  // of a chunk of points, by obstacle and then by point

    void find(Batch& rows, Batch& before, const Substep& now, std::span<const Vec3d> free, std::size_t begin,
              std::size_t end);
    static void keep_of_sleepers(Batch& rows, std::size_t begin, const Batch& before, std::size_t obstacle,
                                 const Substep& now);
    void put_out(Batch& rows, Substep& now) const;

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    std::vector<Batch> rows_, before_;  // a chunk of points each
    std::vector<float> clearance_;      // m, [obstacles, size]: at least as far off is a point from it
    std::vector<Vec3d> asked_at_;       // where that was
    std::vector<float> room_;           // m: as far a point may go, and be pushed, before it can be near any of them
};

}  // namespace rapid

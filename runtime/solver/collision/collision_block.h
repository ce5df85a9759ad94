// A block of points in one substep, shared by all parts of Collisions.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "runtime/points/point_set.h"
#include "runtime/solver/collision/hits.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/step_log.h"

namespace rapid {

// State of points held by a shape, stored between frames. These columns belong to the state and are not written to
// outputs.
//
//   stuckto      the obstacle's key; negative if the point was torn off and still touches it; 0: none
//   stuckface    face of the surface point that holds it (MaterialPoint); `sliding` if it slides along the surface
//   stuckat      position of that surface point: in the body's frame or over the face, without the point's radius
//   stuckP       position after the last step: a point found elsewhere was moved by a script
class StuckColumns {
public:
    static constexpr const char* names[] = {"stuckP", "stuckat", "stuckface", "stuckto"};
    static constexpr std::int32_t sliding = -2;

    // Returns true if a collider holds points.
    static bool are_needed(const Dynamics& dynamics);
    // add_to() creates the missing columns; remove_from() removes them from the set.
    static void add_to(PointSet& points);
    static void remove_from(PointSet& points);

    // Makes the columns writable, on one thread. They must exist.
    explicit StuckColumns(PointSet& points);

    // By index in the set.
    std::span<std::int32_t> to, face;
    std::span<Vec3f> at, P;
};

// Per-set data that contacts read and write, and the frame in which they happen.
struct CollisionContext {
    Hits* hits = nullptr;           // null if no collider records
    std::span<std::uint8_t> dead;   // set to 1 by a collider that kills; empty if none does
    std::uint8_t* met = nullptr;    // set to 1 by every contact; null if not requested
    Strided<float> mass;            // kg
    double time = 0;                // s since the start, at the end of the frame
    double h = 0;                   // s, the frame's length
    StepLog* log = nullptr;         // of all contacts and deaths; null if not requested
    StuckColumns* stuck = nullptr;  // null if no collider holds points
    int drifts = 1;                 // per substep
    // By point of the set: 1 if contacts cannot move it, so that it gets no energy from them; null if all points can
    // move.
    const std::uint8_t* held = nullptr;

    // Marks a point as killed by a collider. time: s since the start.
    void kill(std::size_t point, double at) const
    {
        dead[point] = 1;
        if (log) log->kill(point, at);
    }
};

struct CollisionBlock {
    std::span<const Obstacle> obstacles;
    CollisionContext context;
    std::span<const std::uint32_t> indices = {};  // of the block's points in the set

    // By point, for the substep.
    std::span<Vec3d> P = {}, v = {};     // m, m/s
    std::span<const double> dt = {};     // s
    std::span<const double> after = {};  // s, from its end to the end of the frame

    std::size_t size() const { return indices.size(); }
    // Returns the mass, kg, or nothing if contacts give the point no energy.
    std::optional<double> moved_mass(std::size_t i) const
    {
        const std::uint32_t index = indices[i];
        const double mass = context.mass[index];
        if (std::isinf(mass) || (context.held && context.held[index])) return {};
        return mass;
    }
    double radius(const Obstacle& obstacle, std::size_t i) const { return obstacle.radius[indices[i]]; }
    bool has_member(const Obstacle& obstacle, std::size_t i) const { return obstacle.members[indices[i]]; }

    // Return the time of a point with `left` seconds of its substep remaining: s since the beginning of the frame, and
    // since the start.
    double frame_time(std::size_t i, double left) const { return context.h - after[i] - left; }
    double time(std::size_t i, double left) const { return context.time - after[i] - left; }

    // Returns the distance of a point from an obstacle that is a plane, minus its radius, m.
    double height_over_plane(std::size_t i, const Obstacle& obstacle, const Vec3d& at) const
    {
        return obstacle.plane->n.dot(at) - obstacle.plane->offset - obstacle.radius[indices[i]];
    }

    // Returns true if a path may reach an obstacle that looks for contacts on paths.
    bool may_reach_obstacle(std::size_t i, const Path& path, std::size_t o) const
    {
        const Obstacle& obstacle = obstacles[o];
        if (!obstacle.is_continuous() || !has_member(obstacle, i)) return false;
        return may_reach(path.P, path.at(path.duration), path.a, path.duration, obstacle.radius[indices[i]],
                         obstacle.bounds);
    }
};

}  // namespace rapid

// A block of points in one sub-step, as all parts of Collisions see it.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "runtime/solver/collision/hits.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/collision/stuck_columns.h"
#include "runtime/solver/step_log.h"

namespace rapid {

// What contacts read and write of the whole set, and the frame that they happen in.
struct CollisionContext {
    Hits* hits = nullptr;           // null where no collider records
    std::span<std::uint8_t> dead;   // set to 1 by a collider that kills; empty where none does
    std::uint8_t* met = nullptr;    // set to 1 by every contact; null where nobody asks
    Strided<float> mass;            // kg
    double time = 0;                // s since the start, at the end of the frame
    double h = 0;                   // s, the frame's length
    StepLog* log = nullptr;         // of all contacts and deaths; null where nobody asks
    StuckColumns* stuck = nullptr;  // null where no collider holds points
    int drifts = 1;                 // a sub-step
    // By point of the set: 1 where it stays whatever contacts do to it, and so gets no energy from them; null where all
    // can go.
    const std::uint8_t* held = nullptr;

    // A collider kills a point. time: s since the start.
    void kill(std::size_t point, double at) const
    {
        dead[point] = 1;
        if (log) log->kill(point, at);
    }
};

struct CollisionBlock {
    std::span<const Obstacle> obstacles;
    CollisionContext context;
    std::span<const std::uint32_t> indices = {};  // of the block's points, in the set

    // Of the sub-step, by point.
    std::span<Vec3d> P = {}, v = {};     // m, m/s
    std::span<const double> dt = {};     // s
    std::span<const double> after = {};  // s, from its end to the end of the frame

    std::size_t size() const { return indices.size(); }
    // kg; none where contacts give no energy.
    std::optional<double> moved_mass(std::size_t i) const
    {
        const std::uint32_t index = indices[i];
        const double mass = context.mass[index];
        if (std::isinf(mass) || (context.held && context.held[index])) return {};
        return mass;
    }
    double radius(const Obstacle& obstacle, std::size_t i) const { return obstacle.radius[indices[i]]; }
    bool has_member(const Obstacle& obstacle, std::size_t i) const { return obstacle.members[indices[i]]; }

    // The time of a point with `left` seconds of its sub-step to go: s since the beginning of the frame, and since the
    // start.
    double frame_time(std::size_t i, double left) const { return context.h - after[i] - left; }
    double time(std::size_t i, double left) const { return context.time - after[i] - left; }

    // The distance of a point from an obstacle that is a plane, less its radius, m.
    double height_over_plane(std::size_t i, const Obstacle& obstacle, const Vec3d& at) const
    {
        return obstacle.plane->n.dot(at) - obstacle.plane->offset - obstacle.radius[indices[i]];
    }

    // Whether a path may lead to an obstacle that looks for contacts on paths.
    bool may_reach_obstacle(std::size_t i, const Path& path, std::size_t o) const
    {
        const Obstacle& obstacle = obstacles[o];
        if (!obstacle.is_continuous() || !has_member(obstacle, i)) return false;
        return may_reach(path.P, path.at(path.duration), path.a, path.duration, obstacle.radius[indices[i]],
                         obstacle.bounds);
    }
};

}  // namespace rapid

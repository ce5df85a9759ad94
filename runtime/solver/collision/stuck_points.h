// Points held by a shape (numerics.md, Sticking). A glued point moves with a point of the surface under any force
// until the force exceeds the adhesion. A clinging point slides along the surface, and stays on it within the same
// limit.
//
// The bond is stored (StuckColumns), because it could not be inferred from the position and velocity of a point on a
// surface that turns, deforms or accelerates.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/slide.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class StuckPoints {
public:
    StuckPoints(const CollisionBlock& block, const FreeMotion& motion, TouchedPoints& touched)
        : block_(block), motion_(motion), touched_(touched)
    {
    }

    // Starts a new block.
    void begin();
    // Moves glued points through the substep, and finds those that a shape no longer holds, or holds only on its
    // surface.
    void advance();
    // Updates the bonds after the rounds of contacts; `met` are the points that had contacts.
    void finish(std::span<const std::uint32_t> met);
    // Stores the state at the end of the frame.
    void keep(std::span<const Vec3f> P);

    // A point that continues from its current position for the rest of the substep: freely, or along a surface.
    struct Loose {
        std::uint32_t i;
        double left;  // s
        std::optional<Support> on;
    };

    // A glued point that its shape has carried, up to the time at which it was torn off, if it was.
    struct Carried {
        std::uint32_t i;
        Vec3d P, v;  // before
        Vec3d to_P, to_v;
    };
    const std::vector<Carried>& carried() const { return carried_; }  // in this substep

    // has() returns true if a point is glued, is_held_for_good() if in addition nothing can tear it off, and takes() if
    // it is glued or released.
    bool has(std::size_t i) const { return taken_[i] == Glued; }
    bool is_held_for_good(std::size_t i) const;
    bool takes(std::size_t i) const { return taken_[i] != Free; }
    const std::vector<std::uint32_t>& list() const { return list_; }  // the glued points
    const std::vector<Loose>& loose() const { return loose_; }

    // Glues a point to an obstacle that it touches, and moves it for the `left` seconds of its substep.
    void hold(std::size_t i, int obstacle, double left);
    // Returns true if a point that was torn off an obstacle has not left it since.
    bool is_torn(std::size_t i, int obstacle) const
    {
        return columns_ && columns_->to[block_.indices[i]] == -block_.obstacles[static_cast<std::size_t>(obstacle)].key;
    }

private:
    enum Taken : std::uint8_t { Free, Glued, Released };
    // Distance of a point from the surface that holds it.
    struct Gap {
        double f = 0;  // m, distance - radius
        Vec3d gradient = Vec3d::Zero();
    };

    void find_held();
    void find_resting();
    void query(std::size_t obstacle, const std::vector<std::uint32_t>& points);
    void advance_glued(std::uint32_t i, int obstacle, const Gap& gap);
    void advance_sliding(std::uint32_t i, int obstacle, const Gap& gap);
    void glue(std::uint32_t i, int obstacle, double now);
    void move_with_surface(std::uint32_t i, int obstacle, double now, double duration);
    double time_of_tearing(std::uint32_t i, int obstacle, const Vec3d& kick, double now) const;
    double tension(std::uint32_t i, int obstacle, const Vec3d& pull, double time) const;
    void release(std::uint32_t i) { columns_->to[block_.indices[i]] = 0; }
    MaterialPoint material(std::uint32_t i, int obstacle) const;
    MovingBody::State state(std::uint32_t i, int obstacle, double time) const;
    bool begins_frame(std::uint32_t i) const;
    bool is_elsewhere(std::uint32_t i, int obstacle, double now) const;
    bool bond_is_endless(std::size_t i, int obstacle) const
    {
        return std::isinf(obstacle_at(obstacle).adhesion[block_.indices[i]]);
    }
    Vec3d kick_on(std::uint32_t i, const Vec3d& v) const;
    const Obstacle& obstacle_at(int o) const { return block_.obstacles[static_cast<std::size_t>(o)]; }

    const CollisionBlock& block_;
    const FreeMotion& motion_;
    TouchedPoints& touched_;
    StuckColumns* columns_ = nullptr;
    bool first_ = true;  // first substep of the block
    std::vector<Taken> taken_;
    std::vector<std::optional<Vec3d>> given_;  // the velocity of a glued point at the end of the last substep
    std::vector<std::uint32_t> list_, torn_;
    std::vector<Loose> loose_;
    std::vector<Carried> carried_;
    std::vector<std::vector<std::uint32_t>> held_;  // by obstacle
    std::vector<std::uint8_t> met_;
    DistanceQuery query_;
};

}  // namespace rapid

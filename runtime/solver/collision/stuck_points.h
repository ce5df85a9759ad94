// Points that a shape holds (numerics.md, Sticking): those that are glued to it move with a point of its surface,
// whatever pulls them, until that would take more than the adhesion; those that cling to it slide along it and stay on
// it as long.
//
// What holds a point is stored (StuckColumns): a surface that turns, deforms or speeds up could not be told again from
// the place and velocity of a point alone.
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

    // A new block.
    void begin();
    // Moves the glued points through the sub-step, and finds those that a shape holds no more, or only on its surface.
    void advance();
    // After the rounds of contacts, with the points that had some: whom shapes hold now.
    void finish(std::span<const std::uint32_t> met);
    // At the end of the frame.
    void keep(std::span<const Vec3f> P);

    // A point that is to go on from where it is now, for what is left of the sub-step: freely, or along a surface.
    struct Loose {
        std::uint32_t i;
        double left;  // s
        std::optional<Support> on;
    };

    // A glued point that its shape has taken along, up to the moment at which it was torn off, if it was.
    struct Carried {
        std::uint32_t i;
        Vec3d P, v;  // before
        Vec3d to_P, to_v;
    };
    const std::vector<Carried>& carried() const { return carried_; }  // in this sub-step

    // Whether a point is glued; whether nothing can tear it off, either; whether it is glued, or released to go on.
    bool has(std::size_t i) const { return taken_[i] == Glued; }
    bool holds_for_good(std::size_t i) const;
    bool takes(std::size_t i) const { return taken_[i] != Free; }
    const std::vector<std::uint32_t>& list() const { return list_; }  // of the glued
    const std::vector<Loose>& loose() const { return loose_; }

    // Glues a point to an obstacle that it touches, with `left` seconds of its sub-step to go, and moves it so far.
    void hold(std::size_t i, int obstacle, double left);
    // Whether a point that was torn off an obstacle has not left it since.
    bool is_torn(std::size_t i, int obstacle) const
    {
        return columns_ && columns_->to[block_.indices[i]] == -block_.obstacles[static_cast<std::size_t>(obstacle)].key;
    }

private:
    enum Taken : std::uint8_t { Free, Glued, Released };
    // How far a point is from the surface that holds it.
    struct Gap {
        double f = 0;  // m, distance - radius
        Vec3d gradient = Vec3d::Zero();
    };

    void find_held();
    void find_resting();
    void ask(std::size_t obstacle, const std::vector<std::uint32_t>& points);
    void advance_glued(std::uint32_t i, int obstacle, const Gap& gap);
    void advance_sliding(std::uint32_t i, int obstacle, const Gap& gap);
    void glue(std::uint32_t i, int obstacle, double now);
    void go(std::uint32_t i, int obstacle, double now, double duration);
    double time_of_tearing(std::uint32_t i, int obstacle, const Vec3d& kick, double now) const;
    double tension(std::uint32_t i, int obstacle, const Vec3d& pull, double time) const;
    void let_go(std::uint32_t i) { columns_->to[block_.indices[i]] = 0; }
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
    bool first_ = true;  // sub-step of the block
    std::vector<Taken> taken_;
    std::vector<std::optional<Vec3d>> given_;  // the velocity that a glued point had at the end of the last sub-step
    std::vector<std::uint32_t> list_, torn_;
    std::vector<Loose> loose_;
    std::vector<Carried> carried_;
    std::vector<std::vector<std::uint32_t>> held_;  // by obstacle
    std::vector<std::uint8_t> met_;
    DistanceQuery query_;
};

}  // namespace rapid

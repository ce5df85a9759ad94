// Moves a block of points along their paths through all shapes at once: to the first contact of each path with any
// shape, from there by the response, or along the surface if the point comes to rest on it, until the substep is over
// (numerics.md, Collision). The motion of a point does not depend on the others.
//
// A resting state is not stored: in the next step the point is again found touching the surface and pressed against
// it.
//
// The parts of a substep, in order: StuckPoints are carried along; BroadPhase finds the free paths (FreeMotion) that
// may come near a shape; PlaneContacts solves those near a plane in closed form, and FirstContacts queries the shapes
// for the others; ContactRounds takes points with contacts to the end of the substep; DiscreteMethods corrects
// positions there. PenetrationCorrection and PositionRounding follow at the end of the frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/broad_phase.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/contact_resolver.h"
#include "runtime/solver/collision/contact_rounds.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/ejection.h"
#include "runtime/solver/collision/first_contacts.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/collision/plane_contacts.h"
#include "runtime/solver/collision/stuck_points.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

// The final penetration correction, and the penetration that remains.
//
// Parts of a body that meet, or two bodies, leave no space for a point between them. At the end of the frame the point
// is moved out of both and keeps its velocity: along the shortest way or, if that only leads from one side of a closed
// gap to the other, to the nearest free position.
class PenetrationCorrection {
public:
    PenetrationCorrection(const CollisionBlock& block, const TouchedPoints& touched, ContactAudit& audit)
        : block_(block), touched_(touched), audit_(audit)
    {
    }

    // P: at the end of the frame. lost: points that found no way out of a shape in their substeps.
    void run(std::span<Vec3d> P, const std::vector<std::uint32_t>& lost);
    // The displacements, in order.
    std::span<const Ejection::Displacement> displacements() const { return displacements_; }

    // Returns the largest penetration of a touched point, m, given the rounded positions.
    double deepest(std::span<const Vec3f> P);

private:
    void move_out(const Obstacle& obstacle, std::span<Vec3d> P, bool to_free_position);

    const CollisionBlock& block_;
    const TouchedPoints& touched_;
    ContactAudit& audit_;
    std::vector<std::uint32_t> inside_, still_inside_;
    std::vector<Ejection::Displacement> displacements_;
    DistanceQuery query_;
};

// Rounds positions to single precision at the end of a frame, on the outer side of the surfaces that points are on.
//
// Rounding to nearest may put a point on the inner side of its surface, by up to half an ulp per axis. The coordinate
// with the largest effect is then moved by the least amount that brings the point out again. A point that has not
// moved keeps its bits, so that nothing creeps.
class PositionRounding {
public:
    PositionRounding(const CollisionBlock& block, const TouchedPoints& touched) : block_(block), touched_(touched) {}

    // Starts a new block.
    void begin()
    {
        initial_P_.resize(block_.size());
        for (auto& side : moved_on_) side.resize(block_.obstacles.size());
    }

    // Is called before rounding. Moves points that have moved on surfaces onto them, to double precision, to remove
    // the error of their paths. initial: positions at the beginning of the frame.
    void snap(std::span<Vec3d> P, std::span<const Vec3f> initial);
    // Is called after rounding. Lifts those points to the outer sides of their surfaces.
    void lift(std::span<Vec3f> rounded);

private:
    void find_moved(std::span<const Vec3d> P, std::span<const Vec3f> initial);
    template <class Position, class Use>
    void query_surfaces(const Position& position, const Use& use);
    double tolerance(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const;

    const CollisionBlock& block_;
    const TouchedPoints& touched_;
    std::vector<Vec3f> initial_P_;

    // Points of the block that have moved on a surface in the frame, by the surface's side of an edge and obstacle,
    // and those that can have touched only one plane.
    std::array<std::vector<std::vector<std::uint32_t>>, 2> moved_on_;
    std::vector<std::uint32_t> moved_on_plane_;
    DistanceQuery query_;
};

// The paper's methods, `backtrack` (§4.2) and `project` (§4.1): points inside a shape at the end of a substep are
// moved out of it (numerics.md, Collision).
class DiscreteMethods {
public:
    DiscreteMethods(const CollisionBlock& block, const FreeMotion& motion, StuckPoints& stuck, TouchedPoints& touched,
                    ContactAudit& audit)
        : block_(block), motion_(motion), stuck_(stuck), touched_(touched), audit_(audit)
    {
    }

    // Starts a new block.
    void begin();
    // Returns true if an obstacle uses one of the methods.
    bool is_used() const { return is_used_; }

    // Is called before a substep.
    void begin_substep() { initial_P_.assign(block_.P.begin(), block_.P.end()); }
    // Is called at its end.
    void correct();

    // Returns a bound, m, on the position error since begin() due to contacts found at the end of a substep instead of
    // on the path.
    double position_error(std::size_t i) const { return position_error_[i]; }

private:
    void query_obstacle(const Obstacle& obstacle);
    void correct(int obstacle);
    bool move_out(std::size_t j, int obstacle);
    void backtrack(std::size_t i, const Obstacle& obstacle, const Vec3d& vc, double time, const Vec3d& n, double depth);
    void lift(const Obstacle& obstacle);

    const CollisionBlock& block_;
    const FreeMotion& motion_;
    StuckPoints& stuck_;
    TouchedPoints& touched_;
    ContactAudit& audit_;
    bool is_used_ = false;
    std::vector<Vec3d> initial_P_;        // at the beginning of the substep
    std::vector<double> position_error_;  // m
    DistanceQuery query_;
};

class Collisions {
public:
    Collisions(std::span<const Obstacle> obstacles, const CollisionContext& context) : block_{obstacles, context} {}
    Collisions(const Collisions&) = delete;
    Collisions& operator=(const Collisions&) = delete;

    // Starts a new block with the points at these indices of the set.
    void begin(std::span<const std::uint32_t> indices);

    void advance(std::span<Vec3d> P, std::span<Vec3d> v, const Drift& drift);

    // Rounds the positions to single precision; `rounded` holds those at the beginning of the frame. Points on a
    // surface stay on its outer side. Returns the largest penetration, m, among points that have met a shape since
    // begin().
    double round(std::span<Vec3d> P, std::span<Vec3f> rounded);

    // State of the block's points since begin(). has_met() returns true if a point has met a shape. position_error()
    // bounds the error that a discrete method may have caused, m. is_carried() returns true if the point moved with a
    // shape that holds it permanently. The displacements moved points out of a shape immediately, the corrections in
    // round().
    bool has_met(std::size_t i) const { return touched_.has(i); }
    double position_error(std::size_t i) const { return discrete_.position_error(i); }
    bool is_carried(std::size_t i) const { return stuck_.is_held_for_good(i); }
    std::span<const Ejection::Displacement> displacements() const { return ejection_.displacements(); }
    std::span<const Ejection::Displacement> corrections() const { return correction_.displacements(); }

    // Returns the work of contacts in the motion of a point under linear forces, J/kg, since begin().
    double contact_work(std::size_t i) const { return audit_.work().empty() ? 0 : audit_.work()[i]; }

    // Returns the figures of all blocks.
    const FrameFigures& figures() const { return audit_.figures(); }

private:
    void move_along_free_paths();
    void limit_energy(std::size_t displaced);
    double speed_of_shapes(std::size_t i, const Vec3d& from, const Vec3d& V) const;
    double driven_energy(std::size_t i, const Vec3d& from, double energy, double speed) const;
    void correct();
    void find_first_contacts(std::size_t obstacle);

    CollisionBlock block_;
    FreeMotion motion_{block_};
    TouchedPoints touched_{block_};
    ContactAudit audit_{block_};
    Ejection ejection_{block_};
    StuckPoints stuck_{block_, motion_, touched_};
    BroadPhase broad_phase_{block_};
    FirstContacts contacts_{block_};
    ContactResolver resolver_{block_, motion_, ejection_, stuck_, audit_};
    PlaneContacts planes_{block_, motion_, broad_phase_, contacts_, touched_, audit_};
    ContactRounds rounds_{block_, motion_, contacts_, resolver_, touched_, audit_};
    DiscreteMethods discrete_{block_, motion_, stuck_, touched_, audit_};
    PenetrationCorrection correction_{block_, touched_, audit_};
    PositionRounding rounding_{block_, touched_};
};

}  // namespace rapid

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
#include "runtime/solver/collision/penetration_correction.h"
#include "runtime/solver/collision/plane_contacts.h"
#include "runtime/solver/collision/position_rounding.h"
#include "runtime/solver/collision/stuck_points.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

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

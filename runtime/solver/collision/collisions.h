// Moves a block of points along their paths through all shapes at once: to the first contact along each path, whichever
// shape it is with; from there by the response, or along the surface where the point comes to rest on it; until the
// sub-step is over (numerics.md, Collision). The motion of a point does not depend on the others.
//
// That a point rests is not stored: at the next step it is found touching the surface and pressed to it again.
//
// The parts of a sub-step, in order: StuckPoints are carried along; BroadPhase finds the free paths (FreeMotion) that
// may come near a shape; PlaneContacts solves those near a plane in closed form, FirstContacts asks the shapes about
// the others; ContactRounds takes the points that meet something to the end of the sub-step; DiscreteMethods correct
// positions there. At the end of the frame come PenetrationCorrection and PositionRounding.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/solver/collision/broad_phase.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/contact_resolver.h"
#include "runtime/solver/collision/contact_rounds.h"
#include "runtime/solver/collision/discrete_methods.h"
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

class Collisions {
public:
    Collisions(std::span<const Obstacle> obstacles, const CollisionContext& context) : block_{obstacles, context} {}
    Collisions(const Collisions&) = delete;
    Collisions& operator=(const Collisions&) = delete;

    // A new block, of the points at these indices of the set.
    void begin(std::span<const std::uint32_t> indices);

    void advance(std::span<Vec3d> P, std::span<Vec3d> v, const Drift& drift);

    // Rounds the positions to single precision; `rounded` holds those at the beginning of the frame. What is on a
    // surface stays on its outer side. Returns the deepest that a point which has met a shape since begin() is in one
    // of them, m.
    double round(std::span<Vec3d> P, std::span<Vec3f> rounded);

    // Since begin(), of points of the block: whether one has met a shape; how far off a discrete method may have put
    // it, m; whether it has gone along with a shape that holds it for good; those that were taken out of a shape at
    // once, and by round().
    bool has_met(std::size_t i) const { return touched_.has(i); }
    double position_error(std::size_t i) const { return discrete_.position_error(i); }
    bool is_carried(std::size_t i) const { return stuck_.holds_for_good(i); }
    std::span<const Ejection::Displacement> displacements() const { return ejection_.displacements(); }
    std::span<const Ejection::Displacement> corrections() const { return correction_.displacements(); }

    // J/kg, by contacts in the motion of a point of the block under linear forces, since begin().
    double contact_work(std::size_t i) const { return audit_.work().empty() ? 0 : audit_.work()[i]; }

    // Of all blocks.
    const ContactCounts& counts() const { return audit_.counts(); }

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

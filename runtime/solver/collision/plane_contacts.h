// Takes points that meet only a plane at rest through the whole substep in closed form. On any floor these are most
// points that touch anything, and rounds of contacts would cost several times as much.
#pragma once

#include <cstdint>

#include "runtime/solver/collision/broad_phase.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/first_contacts.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/plane_batch.h"
#include "runtime/solver/collision/slide.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class PlaneContacts {
public:
    PlaneContacts(const CollisionBlock& block, FreeMotion& motion, const BroadPhase& broad_phase,
                  FirstContacts& contacts, TouchedPoints& touched, ContactAudit& audit)
        : block_(block),
          motion_(motion),
          broad_phase_(broad_phase),
          contacts_(contacts),
          touched_(touched),
          audit_(audit)
    {
    }

    // Starts a new block. Obstacles that correct positions after a substep may move points off their planes.
    void begin(bool corrects_positions) { corrects_positions_ = corrects_positions; }

    // Adds a point that may come near this obstacle, a plane, and no other; before points go to the ends of their
    // paths. Full batches are solved immediately, the last one by finish(). The end of a path is then that of the
    // substep. Undecided points are left to `contacts`.
    void add(std::uint32_t i, std::size_t o)
    {
        const Obstacle& obstacle = block_.obstacles[o];
        const std::uint32_t index = block_.indices[i];
        batch_.add(i, block_.P[i], block_.v[i], motion_.acceleration(i), block_.dt[i],
                   {obstacle.radius[index], obstacle.restitution(index), obstacle.friction[index]});
        if (batch_.is_full()) finish(o);
    }
    void finish(std::size_t obstacle);

    // Takes a point from the beginning of its substep to the end if its first contact is with a plane that it lies on,
    // and it meets nothing else. The result is bit-identical to that of ContactRounds, at a third of the cost.
    bool slides_on_plane(std::size_t i);

private:
    void take(std::size_t j, std::size_t obstacle);
    bool slide_on_plane(std::size_t i, const Support& on);
    bool may_meet_another(std::size_t i, const Path& path, int obstacle) const;

    const CollisionBlock& block_;
    FreeMotion& motion_;
    const BroadPhase& broad_phase_;
    FirstContacts& contacts_;
    TouchedPoints& touched_;
    ContactAudit& audit_;
    bool corrects_positions_ = false;
    PlaneBatch batch_;
};

}  // namespace rapid

// Points that meet a plane at rest, and nothing else, go through the whole sub-step in closed form: most points that
// touch anything, on any floor, and at a fraction of what rounds of contacts would cost.
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

    // A new block. Obstacles that correct positions after a sub-step may move points off their planes.
    void begin(bool corrects_positions) { corrects_positions_ = corrects_positions; }

    // Before points go to the ends of their paths: adds one that may come near this obstacle, a plane, and near no
    // other. Batches are solved as they fill, and the last by finish(); the end of a path is then that of the sub-step.
    // Points for which a batch has no answer are left to `contacts`.
    void add(std::uint32_t i, std::size_t o)
    {
        const Obstacle& obstacle = block_.obstacles[o];
        const std::uint32_t index = block_.indices[i];
        batch_.add(i, block_.P[i], block_.v[i], motion_.acceleration(i), block_.dt[i],
                   {obstacle.radius[index], obstacle.restitution(index), obstacle.friction[index]});
        if (batch_.is_full()) finish(o);
    }
    void finish(std::size_t obstacle);

    // Takes a point at the beginning of its sub-step through all of it if its first contact is with a plane that it
    // lies on, and it meets nothing else along it: to the bit what ContactRounds would do, at a third of its cost.
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

// Takes points of a block that have met a shape through the rest of their substep. They proceed together, each by one
// path per round, so that a shape is called once per round and never once per point.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_resolver.h"
#include "runtime/solver/collision/curved_motion.h"
#include "runtime/solver/collision/first_contacts.h"
#include "runtime/solver/collision/path_planner.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class ContactRounds {
public:
    ContactRounds(const CollisionBlock& block, FreeMotion& motion, FirstContacts& contacts, ContactResolver& resolver,
                  TouchedPoints& touched, ContactAudit& audit)
        : block_(block),
          motion_(motion),
          contacts_(contacts),
          resolver_(resolver),
          touched_(touched),
          audit_(audit),
          planner_(block, motion, audit),
          curved_(block, motion, resolver)
    {
    }

    // Takes a point, which is at the beginning of its substep, to the first contact on its free path.
    void start(std::uint32_t i);
    // Lets a point continue freely, or along its support, for the `left` seconds of its substep.
    void resume(std::uint32_t i, double left, const std::optional<Support>& on);
    // Takes all started points to the end of the substep.
    void run();

private:
    bool goes_on(CollidingPoint& point);
    bool may_meet_shape(const CollidingPoint& point) const;
    bool may_meet(const CollidingPoint& point, std::size_t obstacle) const;
    void find_contacts();

    const CollisionBlock& block_;
    FreeMotion& motion_;
    FirstContacts& contacts_;
    ContactResolver& resolver_;
    TouchedPoints& touched_;
    ContactAudit& audit_;
    PathPlanner planner_;
    CurvedMotion curved_;

    std::vector<CollidingPoint> points_;  // the first started_ belong to this substep
    std::size_t started_ = 0;
    std::vector<std::uint32_t> going_,
        going_on_;  // unfinished points_: in this round and the next
};

}  // namespace rapid

// Plans the next path of a point that has met a shape: a free parabola, a slide along a flat surface or an edge, or a
// piece along a curved surface.
#pragma once

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/free_motion.h"

namespace rapid {

class PathPlanner {
public:
    PathPlanner(const CollisionBlock& block, FreeMotion& motion, ContactAudit& audit)
        : block_(block), motion_(motion), audit_(audit)
    {
    }

    // Returns false if there is no path because the point's substep is over.
    bool plan(CollidingPoint& point);
    // Moves the point to the end of its path, which must be free of contacts.
    void finish_path(CollidingPoint& point);

private:
    Slide slide(CollidingPoint& point);
    bool slide_along_surface(CollidingPoint& point, const Slide& slide);
    void slow_down(CollidingPoint& point) const;
    bool chatters(CollidingPoint& point) const;
    void ride(CollidingPoint& point);

    const CollisionBlock& block_;
    FreeMotion& motion_;
    ContactAudit& audit_;
};

}  // namespace rapid

// Resolves a contact of a point: it bounces, comes to rest on the surface, sticks, dies, or is moved out of the shape.
#pragma once

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/ejection.h"
#include "runtime/solver/collision/free_motion.h"

namespace rapid {

class ContactResolver {
public:
    // The state in which a point arrives at a contact; path_v: velocity of the path on which the contact was found.
    struct Arrival {
        Vec3d P, v, a, path_v;
    };

    ContactResolver(const CollisionBlock& block, const FreeMotion& motion, Ejection& ejection, StuckPoints& stuck,
                    ContactAudit& audit)
        : block_(block), motion_(motion), ejection_(ejection), stuck_(stuck), audit_(audit)
    {
    }

    // Moves a point to a contact on its path, and sets the velocity with which it leaves.
    void resolve(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int obstacle);
    // Resolves a contact on the planned path.
    void resolve_on_path(CollidingPoint& point, const Contact& contact, int obstacle);

private:
    Arrival arrival_on_chord(CollidingPoint& point, double time) const;
    void capture(CollidingPoint& point, const Contact& contact, int obstacle);
    void respond(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int obstacle);
    void part(CollidingPoint& point, const Arrival& arrival, const Contact& contact, int obstacle, double pull);
    void bounce(CollidingPoint& point, const Support& support, double bounce);
    void rest(CollidingPoint& point, const Support& support, const Vec3d& v);
    bool is_same_surface(const CollidingPoint& point, const Support& support, const Vec3d& along) const;

    const CollisionBlock& block_;
    const FreeMotion& motion_;
    Ejection& ejection_;
    StuckPoints& stuck_;
    ContactAudit& audit_;
};

}  // namespace rapid

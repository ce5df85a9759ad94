// Takes points of a block that have met a shape through the rest of their substep. They proceed together, each by one
// path per round, so that a shape is called once per round and never once per point.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/contact_resolver.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/first_contacts.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

// Plans the next path of a point that has met a shape: a free parabola, a slide along a flat surface or an edge, or a
// piece along a curved surface.
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
    void move_with_surface(CollidingPoint& point);

    const CollisionBlock& block_;
    FreeMotion& motion_;
    ContactAudit& audit_;
};

// Motion along curved surfaces, in pieces of second order in position and velocity: velocity Verlet in the plane that
// turns with the surface. Points on the same shape take their pieces together.
//
// The piece d = v s + a s²/2 is tangential at its beginning. At its end the surface has turned by θ, so the chord of
// an arc of this length is d (1 - θ²/24), halfway between the tangents of both ends. The remaining distance from the
// surface is removed along the gradient.
class CurvedMotion {
public:
    CurvedMotion(const CollisionBlock& block, const FreeMotion& motion, ContactResolver& resolver)
        : block_(block), motion_(motion), resolver_(resolver)
    {
    }

    // Finds the ends of curved paths among the points with the indices `active`. Each path is then the chord to its
    // end, in the world frame. A point waits if the surface is too uneven for the piece, and leaves if the surface
    // falls away.
    void find_ends(std::span<CollidingPoint> points, std::span<const std::uint32_t> active);

private:
    void begin_pieces(std::span<CollidingPoint> points, std::span<const std::uint32_t> active, int obstacle);
    bool follow_arc(CollidingPoint& point, std::size_t j);
    void wait_for(CollidingPoint& point, double shortest) const;
    void leave_surface(CollidingPoint& point) const;
    void meet_kink(CollidingPoint& point, const Vec3d& n);
    void project(std::span<const CollidingPoint> points, const Obstacle& obstacle);
    void step_to_surface(std::size_t i, std::size_t j, const Obstacle& obstacle);
    void end_piece(CollidingPoint& point, std::size_t j) const;
    void draw_chord(CollidingPoint& point) const;
    void follow_surface(std::span<CollidingPoint> points, const Obstacle& obstacle);
    bool find_end_velocity(CollidingPoint& point) const;
    void find_end_velocity_on_moving(CollidingPoint& point) const;

    const CollisionBlock& block_;
    const FreeMotion& motion_;
    ContactResolver& resolver_;
    DistanceQuery query_;  // by index among the points
};

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
    bool plan_next_path(CollidingPoint& point);
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
    std::vector<std::uint32_t> active_, next_active_;  // unfinished points_: now and in the next round
};

}  // namespace rapid

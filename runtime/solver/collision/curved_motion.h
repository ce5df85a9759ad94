// Motion along curved surfaces, in pieces of second order in position and velocity: velocity Verlet in the plane that
// turns with the surface. Points on the same shape take their pieces together.
//
// The piece d = v s + a s²/2 is tangential at its beginning. At its end the surface has turned by θ, so the chord of
// an arc of this length is d (1 - θ²/24), halfway between the tangents of both ends. The remaining distance from the
// surface is removed along the gradient.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/solver/collision/colliding_point.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_resolver.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/free_motion.h"

namespace rapid {

class CurvedMotion {
public:
    CurvedMotion(const CollisionBlock& block, const FreeMotion& motion, ContactResolver& resolver)
        : block_(block), motion_(motion), resolver_(resolver)
    {
    }

    // Finds the ends of curved paths among the points with the indices `going`. Each path is then the chord to its
    // end, in the world frame. A point waits if the surface is too uneven for the piece, and leaves if the surface
    // falls away.
    void find_ends(std::span<CollidingPoint> points, std::span<const std::uint32_t> going);

private:
    void begin_pieces(std::span<CollidingPoint> points, std::span<const std::uint32_t> going, int obstacle);
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

}  // namespace rapid

// Takes points that meet only a plane at rest through the whole substep in closed form. On any floor these are most
// points that touch anything, and rounds of contacts would cost several times as much.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/shapes/shape.h"
#include "runtime/solver/collision/broad_phase.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/first_contacts.h"
#include "runtime/solver/collision/free_motion.h"
#include "runtime/solver/collision/slide.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

// Points that may come near one plane at rest and nothing else, many at once: those that miss it, bounce once, or lie
// on it under friction only. This covers most points that touch anything. The loop has no branches, so it vectorizes.
// It gives the result of ContactRounds at a twentieth of the cost.
//
// Layout: structure of arrays; coordinates are shape [3, capacity].
class PlaneBatch {
public:
    static constexpr std::size_t capacity = 64;
    enum Outcome : std::int64_t { Undecided, Misses, Slides, Bounces };

    std::size_t size() const { return size_; }
    bool is_full() const { return size_ == capacity; }
    void clear() { size_ = 0; }

    // The surface properties for a point.
    struct Surface {
        double radius, bounce, friction;
    };
    // i: in the block. a: m/s², constant. dt: s.
    void add(std::uint32_t i, const Vec3d& P, const Vec3d& v, const Vec3d& a, double dt, const Surface& surface)
    {
        const std::size_t j = size_++;
        point_[j] = i;
        for (int axis = 0; axis < 3; ++axis) {
            P_[axis][j] = P[axis];
            v_[axis][j] = v[axis];
            a_[axis][j] = a[axis];
        }
        dt_[j] = dt;
        radius_[j] = surface.radius;
        bounce_[j] = surface.bounce;
        friction_[j] = surface.friction;
    }

    // Advances all points through their steps.
    void solve(const HalfSpace& plane);

    // Makes sliding and bouncing points undecided if they may come near this box; radius: their largest, m.
    void mark_undecided_near(const Box3d& box, double radius);

    std::uint32_t point(std::size_t j) const { return point_[j]; }
    Outcome outcome(std::size_t j) const { return static_cast<Outcome>(outcome_[j]); }
    Vec3d end(std::size_t j) const { return at(end_, j); }         // m
    Vec3d velocity(std::size_t j) const { return at(v_end_, j); }  // m/s, at the end

    // For a bounce.
    Vec3d contact(std::size_t j) const { return at(contact_, j); }  // m; of a slide, its beginning
    double left(std::size_t j) const { return left_[j]; }           // s, of the step after the bounce
    double approach(std::size_t j) const { return approach_[j]; }   // m/s
    Vec3d change(std::size_t j) const { return at(change_, j); }    // in velocity, m/s

private:
    using Coordinates = double[3][capacity];
    static Vec3d at(const Coordinates& x, std::size_t j) { return {x[0][j], x[1][j], x[2][j]}; }

    std::size_t size_ = 0;
    std::uint32_t point_[capacity];
    double dt_[capacity], radius_[capacity], bounce_[capacity], friction_[capacity];
    Coordinates P_, v_, a_;

    std::int64_t outcome_[capacity];
    double left_[capacity], approach_[capacity];
    Coordinates end_, v_end_, contact_, change_;
    Coordinates sagging_;  // the largest distance of the path from the straight line to its end, m
};

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

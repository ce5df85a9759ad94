// Moves a block of points along their paths through all shapes at once: to the first contact along each path, whichever
// shape it is with; from there by the response, or along the surface where the point comes to rest on it; until the
// sub-step is over (numerics.md, Collision).
//
// The points of a block that have met something go on together, round by round, so that a shape is called once a round
// and never once a point. What becomes of a point does not depend on the others.
//
// That a point rests is not stored: at the next step it is found flush with the surface and pressed to it again.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/collision/contact_energy.h"
#include "runtime/solver/collision/hits.h"
#include "runtime/solver/collision/plane_pass.h"
#include "runtime/solver/collision/slide.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/motion/damped_motion.h"
#include "runtime/solver/motion/free_paths.h"

namespace rapid {

// A collider with its parameters looked up for all points of a set.
struct Obstacle {
    // Error: a parameter's attribute is missing.
    Obstacle(const Collider& collider, const PointSet& points);

    const Shape* shape;
    Box3d bounds;
    double feature;  // m, the shape's smallest
    bool moves;
    const RigidBody* body;  // null where it does not move as one
    std::optional<HalfSpace> plane;
    Method method;
    Response response;
    std::optional<double> record;  // m/s
    Strided<float> bounce, friction, radius;
    Strided<std::uint8_t> members;  // of its group; 1 for all where it has none
};

// What a point may meet in one sub-step before the rest of it is dropped, counted in contacts and in pieces of a way
// along a curved surface.
constexpr int most_contacts = 100000;

// One sub-step, or a part of it, of all points of a block.
struct Drift {
    Strided<Vec3d> a;                // m/s², constant within it
    std::span<const double> dt;      // s
    std::span<const double> after;   // s, from its end to the end of the frame
    std::span<const Damped> damped;  // where it is not empty, in place of a
};

// Of the marks of points at these places of the set, leaves those of points that are outside of all obstacles at P, at
// the end of the frame; shapes [n].
void keep_outside(std::span<const Obstacle> obstacles, std::span<const std::uint32_t> places, std::span<const Vec3d> P,
                  std::span<std::uint8_t> marks);

// What a contact does besides, to points of the whole set.
struct Consequences {
    Hits* hits = nullptr;          // null where no collider records
    std::span<std::uint8_t> dead;  // set to 1 by a collider that kills; empty where none does
    std::uint8_t* met = nullptr;   // set to 1 by every contact; null where nobody asks
    Strided<float> mass;           // kg
    double time = 0;               // s since the start, at the end of the frame
    double h = 0;                  // s, the frame's length
};

class Collisions {
public:
    Collisions(std::span<const Obstacle> obstacles, const Consequences& consequences)
        : obstacles_(obstacles), consequences_(consequences)
    {
    }

    // A new block, of the points at these places of the set.
    void begin(std::span<const std::uint32_t> places);

    void advance(std::span<Vec3d> P, std::span<Vec3d> v, const Drift& drift);

    // Rounds the positions to single precision; `rounded` holds those at the beginning of the frame. What is on a
    // surface stays on its outer side. Returns the deepest that a point which has met a shape since begin() is in one
    // of them, m.
    double round(std::span<Vec3d> P, std::span<Vec3f> rounded);

    // Whether a point of the block has met a shape since begin().
    bool has_met(std::size_t i) const { return met_[i] != 0; }
    // The points of the block that were in a shape, and by how much they have been put out since begin(), m: at once,
    // which is no motion.
    struct PutOut {
        std::uint32_t i;
        Vec3d by;
    };
    std::span<const PutOut> put_out() const { return put_out_; }
    // How far off a contact that was found at the end of a sub-step, not on the path, may have put it since begin(), m.
    double put_off(std::size_t i) const { return put_off_[i]; }

    std::uint64_t contacts = 0;  // faster than those that a point at rest has by rounding
    std::uint64_t limited = 0;   // points that ran into the limit of contacts in a step
    std::uint64_t trapped = 0;   // points that are in a shape at the end of the frame, with no way out
    ContactEnergy energy;        // of points without linear forces, which take energy all the time

private:
    // A point that has met something in this sub-step.
    struct Traveller {
        enum Way { Free, Straight, Curved, Waits };

        std::uint32_t i = 0;  // place in the block
        double left = 0;      // s of the sub-step
        double piece = 0;     // s: the length of the next piece along a curved surface
        int events = 0;       // towards most_contacts
        int rescues = 0;      // times that it was taken out of a shape
        int watched = 0;      // events when `stood` was taken
        Vec3d stood = Vec3d::Constant(std::numeric_limits<double>::infinity());  // where it was then
        int supports = 0;  // surfaces that it rests on: of two, it moves along their edge
        Support on[2] = {};

        // Of the round.
        Way way = Free;
        bool stops = false;  // at the end of the path, on the surface

        void begin(std::uint32_t place, double dt)
        {
            i = place;
            left = piece = dt;
            events = rescues = watched = supports = 0;
            stood.setConstant(std::numeric_limits<double>::infinity());
            way = Free;
            stops = false;
        }
    };

    // The end of a piece along a curved surface.
    struct Bend {
        Vec3d P, v, n;
        Vec3d a;  // of the piece, at its beginning
        double curvature;
    };

    struct Surface {
        int obstacle;  // -1 for none
        Vec3d n;
    };
    inline static const Surface no_surface{-1, Vec3d::Zero()};

    void fly(Strided<Vec3d> a, std::span<const double> dt);
    Path free_path(std::size_t i, double dt) const;
    double since_begin(std::size_t i, double left) const;
    Vec3d velocity_after(std::size_t i, double s, double dt) const;
    void round_of_travellers(Strided<Vec3d> a, std::span<const double> dt);
    bool slides_on_plane(std::size_t i, const Vec3d& a, double dt);
    void pass_plane(int obstacle, std::span<const double> dt);
    void ask_about(std::uint32_t i, int obstacle, double dt);
    bool goes_on(Traveller& t, const Vec3d& a, double dt);
    bool plan(Traveller& t, Path& path, const Vec3d& a, double dt);
    bool chatters(Traveller& t);
    void bend(Strided<Vec3d> a, std::span<const double> dt);
    void bend_on(int obstacle, Strided<Vec3d> a, std::span<const double> dt);
    bool may_reach_shape(std::size_t i, const Vec3d& from, const Vec3d& to, const Vec3d& a, double duration,
                         std::size_t obstacle) const;
    bool may_meet(const Traveller& t, const Path& path, int obstacle) const;
    void search();
    void ask_first_contacts(int obstacle);
    void meet(Traveller& t, const Vec3d& P, const Vec3d& v, const Vec3d& a, const Contact& contact, int obstacle,
              double dt);
    void meet_on_bend(Traveller& t, const Path& chord, const Bend& bend, const Contact& contact, int obstacle,
                      double dt);
    void meet_on_path(Traveller& t, const Path& path, double dt);
    void leave_shape(Traveller& t, const Contact& contact, int obstacle, const Vec3d& a);
    void settle(Traveller& t, const Support& support, const Vec3d& v);
    void touch(std::size_t i);
    void hold_stuck(std::span<const double> dt);
    Vec3d acceleration_of(const Obstacle& obstacle, const Vec3d& P, const Vec3d& v, double time) const;
    Vec3d normal_at(const Obstacle& obstacle, const Vec3d& P, double time) const;
    bool takes(Traveller& t, const Contact& contact, int obstacle);
    void count(std::size_t i, const Vec3d& P, const Vec3d& n, const Vec3d& vc, double speed, const Vec3d& change,
               double time, int obstacle);
    void correct(int obstacle, std::span<const double> dt);
    void audit_energy();
    void proceed(Traveller& t, const Path& path, const Bend& bend);
    void finish(const Traveller& t);
    template <class Place, class Use>
    void ask_surfaces(const Place& place, const Use& use);
    void take_out(std::span<Vec3d> P, std::vector<std::uint32_t> inside);
    double over_plane(std::size_t i, const Vec3d& P) const;
    double flush_of_way(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const;
    double deepest(std::span<const Vec3f> P);

    std::span<const Obstacle> obstacles_;
    const Consequences consequences_;
    std::span<const std::uint32_t> places_;  // of the block's points, in the set
    std::size_t size_ = 0;
    std::vector<double> widest_;  // of each obstacle, the largest radius in the block, m
    bool steps_back_ = false;     // whether an obstacle looks at the ends of sub-steps

    std::span<Vec3d> P_, v_;
    Strided<Vec3d> a_{nullptr, 0};  // of the sub-step, without the forces of surfaces

    // Empty where no force has a linear part; else, by point, its way, and the mean acceleration of what is left of it,
    // to which a_ then points.
    std::span<const Damped> damped_;
    std::vector<Vec3d> path_v_, path_a_, mean_a_;

    FreePaths flight_;

    // By point of the block.
    std::span<const double> after_;    // s, to the end of the frame
    std::vector<std::uint8_t> stuck_;  // whether it is held by a shape that it sticks to
    std::vector<Vec3d> start_;         // where it was at the beginning of the sub-step
    std::vector<std::uint8_t> met_;    // whether it has met a shape since begin()
    std::vector<double> put_off_;      // m
    std::vector<PutOut> put_out_;
    std::vector<int> near_count_;        // how many shapes it may come near
    std::vector<int> obstacle_;          // the first that the path meets, or -1
    std::vector<Contact> contact_;       // with it
    std::vector<Traveller> travellers_;  // and the next three of those that have met something
    std::vector<Path> paths_;
    std::vector<Bend> bends_;
    std::vector<std::array<Surface, 2>> surfaces_;  // that it is on now
    std::vector<Vec3f> before_;                     // at the beginning of the frame
    std::vector<int> plane_;  // the plane that is all it can have touched at the end of the sub-step, or -1

    // Places in the block.
    std::vector<std::vector<std::uint32_t>> near_;  // by obstacle, those whose free path may come near it
    std::vector<std::uint32_t> touched_;            // those that have met a shape since begin()
    // Of these, those that are elsewhere on a surface than at the beginning of the frame, by the surface's side and
    // obstacle.
    std::array<std::vector<std::vector<std::uint32_t>>, 2> moved_on_;
    std::vector<std::uint32_t> moved_on_plane_;    // and those of them that can have touched one plane only
    std::vector<std::uint32_t> lost_;              // those that found no way out in their step
    std::vector<std::uint32_t> held_;              // those that are stuck
    std::vector<std::uint32_t> meeting_;           // those whose free path meets a shape
    std::vector<std::uint32_t> going_, going_on_;  // those whose sub-step is not over

    PlanePass pass_;

    // What a shape is asked.
    std::vector<std::size_t> asked_;
    std::vector<Path> asked_paths_;
    std::vector<Contact> answers_;
    std::vector<Vec3d> asked_P_, gradients_;
    std::vector<double> asked_time_;  // s since the beginning of the frame
    std::vector<double> phi_;
};

}  // namespace rapid

// Contacts with shapes within the projection: shapes keep out points that other constraints push into them.
//
// Free motion has already taken each point around all shapes (collisions.h). The impulses here only balance the
// pressure of other points, along the normal and by the Coulomb friction that follows from it. A contact is C = n·x -
// level >= 0, with the shape's tangent plane at the end of the point's free motion. At the end of the substep, points
// inside the shape itself are moved out.
//
// Each substep starts with the impulses of the previous one, even across frames, so that a pile at rest is already
// solved before the first iteration.
// is iterated.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/energy_bound.h"

namespace rapid {

// A fingerprint of the shapes that points rest on. It changes when a shape is added, removed, moved or tilted, or
// changes its friction, bounce or response.

// Distance, in radii, below which a point touches a shape; a resting point may also be flush with it.
constexpr double touch = 0.01;

struct ShapeGrip {
    std::uint64_t hash = 0;        // of the touched shapes' indices in the chain and their parameters
    Vec3f normal = Vec3f::Zero();  // the sum of their normals

    bool is_like(const ShapeGrip& other) const;
};

// Returns the grips of the points with these indices in P; time: s since the beginning of the frame.
std::vector<ShapeGrip> shape_grips(std::span<const std::uint32_t> points, std::span<const Obstacle> obstacles,
                                   std::span<const Vec3d> P, double time);

// Finds points that may be near shapes from lower bounds of their distances, so that most points need no query in a
// substep.

// Returns the radius that limits how far a point may be pushed, m: the larger of its radii for the shape and for other
// points. sizes: the latter by point; empty if points do not meet.
float push_radius(std::span<const float> sizes, const Obstacle& obstacle, std::size_t i);

// Query of a chunk's points for their distances from a shape. Reused to keep its memory.
struct ShapeQuery {
    std::span<const Vec3d> free;             // positions after the points' free motion
    std::size_t begin = 0;                   // the chunk's first point
    double since = 0;                        // s, from the beginning of the frame to the end of the substep
    std::vector<std::uint32_t> open;         // points that may be near some shape
    std::vector<double> moved, since_query;  // m, in this substep, and since distances were first queried; by chunk

    std::vector<std::uint32_t> queried;  // points queried for one shape
    std::vector<Vec3d> P, gradient;      // of the queried points
    std::vector<double> phi, time;       // m, s
    std::span<const float> sizes;        // m: radii at which points meet one another; empty if they do not

    // Returns the distance that a point may move in a substep, m. Contacts that are farther away are skipped.
    double reach(const Obstacle& obstacle, std::size_t i) const;
};

class ShapeClearance {
public:
    ShapeClearance(std::span<const Obstacle> obstacles, std::size_t size);

    // Lists the open points from `begin` to `end`.
    void open(ShapeQuery& query, const Substep& step, std::size_t end);
    // Queries one shape for the points that may be near it, and stores their distances.
    void query(ShapeQuery& query, std::size_t obstacle, const Substep& step);
    // Updates the room of open points from one shape. Called after all shapes have been queried.
    void close(const ShapeQuery& query, std::size_t obstacle);
    void begin(std::span<const Vec3d> free);

private:
    void list(ShapeQuery& query, std::size_t obstacle, const Substep& step);

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    bool any_moves_;
    std::vector<float> clearance_;  // m, [obstacles, size]: lower bound of the distance at query_positions_
    std::vector<Vec3d> query_positions_;
    std::vector<float> room_;  // m: distance that a point may move or be pushed without coming near any of them
};

// The loads on shapes at the end of a frame: the warm start of the next one.
struct ShapeLoads {
    struct Load {
        std::int64_t id;
        std::uint32_t obstacle;
        float normal;   // N
        Vec3f tangent;  // N
        Vec3f rolling;  // N: torque / radius
    };
    std::vector<Load> loads;
};

class ShapeContacts {
public:
    // sizes: m, the radii at which points meet one another, shape [size]; empty if they do not. sleep: null if no point
    // may sleep.
    ShapeContacts(std::span<const Obstacle> obstacles, std::size_t size, std::vector<float> sizes, const Sleep* sleep);

    void recall(const ShapeLoads& loads, const Column<std::int64_t>& ids, double dt);
    void remember(ShapeLoads& loads, const Column<std::int64_t>& ids, const Substep& step) const;

    // free: positions after the points' free motion.
    void detect(const Substep& step, std::span<const Vec3d> free);
    // Runs one sweep over the points that were hit by others in this sweep or the previous one.
    void solve_impacts(Substep& step, std::uint32_t sweep);
    void warm_start(Substep& step);
    void project(Substep& step);
    void solve_velocities(Substep& step);
    // Adds to step.forces, including the impulses of shapes during free motion.
    void add_forces(const Substep& step) const;
    // Makes shapes the drivers of the points that they support.
    void drive(EnergyIslands& islands, const Substep& step) const;

private:
    struct ShapeContact {
        std::uint32_t i, obstacle;
        Vec3d n, vc;                               // unit normal out of the shape; its velocity, m/s
        double level;                              // m: n·x is larger on the shape's outer side
        double friction;                           // μ
        double normal_impulse;                     // N s along n: first for the projection of positions, then the total
        double carried_impulse;                    // N s along n: given by the warm start to velocities only
        Vec3d turning = Vec3d::Zero();             // rad/s, of the shape; 0 for points that do not turn
        Vec3d tangential_impulse = Vec3d::Zero();  // N s along the surface
        Vec3d rolling_impulse = Vec3d::Zero();     // N s: torque / radius, of rolling friction
        // N s: the impulse of the shape in free motion, along n and along the surface. Known if Substep::reaction is
        // set.
        double free_impulse = 0;
        Vec3d free_friction = Vec3d::Zero();
    };
    using Batch = std::vector<ShapeContact>;  // of a chunk of points, sorted by obstacle and then by point
    static bool is_before(const ShapeContact& a, const ShapeContact& b)
    {
        return std::pair(a.obstacle, a.i) < std::pair(b.obstacle, b.i);
    }

    bool is_flush(const ShapeContact& contact, const Substep& step) const;
    void find(Batch& contacts, const Batch& before, const Substep& step, std::span<const Vec3d> free, std::size_t begin,
              std::size_t end);
    ShapeContact contact(const ShapeQuery& query, std::size_t k, std::size_t obstacle, const Substep& step) const;
    void follow_turning(ShapeContact& contact, const Vec3d& P, double time) const;
    void keep_sleeper_contacts(Batch& contacts, std::size_t begin, const Batch& before, std::size_t obstacle) const;
    void solve_impact(const ShapeContact& contact, Substep& step, std::uint32_t sweep) const;
    void share_reactions(const Substep& step);
    void share_reaction(std::span<ShapeContact* const> contacts, std::uint32_t i, const Substep& step,
                        Batch& missed) const;
    std::optional<ShapeContact> missed_contact(std::uint32_t i, const Vec3d& impulse, const Substep& step) const;
    static void start_spinning(ShapeContact& contact, Substep& step);
    static void solve_spinning(ShapeContact& contact, Substep& step);
    static void skip_separating(ShapeContact& contact, const Substep& step);
    static void solve_velocity(ShapeContact& contact, Substep& step);
    void move_out(const Batch& contacts, Substep& step) const;

    std::span<const Obstacle> obstacles_;
    std::size_t size_;
    const Sleep* sleep_;
    ShapeClearance clearance_;
    std::vector<float> sizes_;              // m: the largest of the constraints' radii; empty if they have none
    std::vector<Batch> contacts_, before_;  // by chunk of points
};

}  // namespace rapid

// Constraints between points (paper §5): the interface that a constraint node implements, for Solve to project.
//
// A Constraint is added by a node to the points that travel down a chain. In each frame it gives the solver a
// Coupling: its rows, which are scalar constraints C(x) = 0 or C(x) >= 0 over a few points each, with their impulses.
// The steps of one substep (numerics.md, Constraints):
//
//   x~ = P + v dt + a dt²/2         free motion: each point moves under its forces, actions and collisions
//   move_kinematic()                moves points with prescribed positions
//   advance()                       moves points that rods and springs link under those forces, too
//   detect()                        finds the rows of this substep, e.g. contacts
//   solve_impacts()                 restitution, at the times of impacts within the substep, until no impact is left
//   warm_start()                    applies the impulses of the previous substep
//   project()                       P = x~ + Δx by Gauss-Seidel, `iterations` times; Δx = w ∇C p dt
//   v + Δx/dt                       never the difference of stored positions
//   solve_velocities()              friction; velocities left along rigid rows; breaking rows. Runs `iterations` times
//                                   if shapes or rods act as well
//   add_forces()                    records the impulses if Substep::forces is set
//   correct_penetration()           removes penetration that is still too deep, after all shapes
//
// w is the inverse mass times v_of_a / dt, with v_of_a the mobility of the velocity under drag and springs, so that a
// damped point supports the weight of points that lie on it. Rods and springs use both mobilities, which is exact.
//
// Most constraints need only a residual and its gradient: rows.h builds a Coupling from these.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/projected_point.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/forces.h"

namespace rapid {

class ContactForces;
class EnergyIslands;
class Sleep;
class StepLog;
struct ContactMaterial;
struct FrameFigures;
struct Spin;

// The coupled points of a set in one substep; shapes [size].
struct Substep {
    std::span<ProjectedPoint> points;      // after their free motion
    std::span<Vec3d> v;                    // m/s, at the end of the substep
    std::span<Vec3d> start;                // positions at its beginning; moved by position-only corrections
    std::span<const Vec3d> born;           // the same before points were moved out of shapes; empty if none can be
    std::span<const double> energy;        // J, kinetic and potential at its beginning; empty if mobility is
    std::span<const std::uint8_t> dead;    // 1: no longer takes part; empty if no point can have died
    std::span<const double> inverse_mass;  // 1/kg; 0 for points that do not move by themselves
    std::span<const Mobility> mobility;    // empty if no force has a linear part
    std::span<const SurfaceSpring> surface_springs;  // empty if mobility is; w2 is 0 for a point without one
    // m: the distance each moving point covers by its acceleration until it reaches its final velocity, without
    // collisions. Empty unless some constraint has forces.
    std::span<Vec3d> displacement;
    // m/s, at the beginning of the substep, of points that shapes carry; 0 for others. Empty if there are no shapes.
    std::span<const Vec3d> carried_v;
    std::span<FreePath> paths;  // empty if nothing bounces
    // m/s: the velocity change that shapes caused in each point's free motion. Empty unless requested.
    std::span<Vec3d> reaction;
    std::span<Spin> spins;               // empty if no point turns
    ContactForces* forces = nullptr;     // null if they are not recorded
    StepLog* log = nullptr;              // null if not requested
    bool is_shared = false;              // contacts, shapes or other constraints act alongside this constraint
    double dt = 0;                       // s, for a point that lives through the whole frame
    double time = 0;                     // s since the start, at its end
    double max_acceleration = 0;         // m/s², due to forces
    Vec3d acceleration = Vec3d::Zero();  // m/s², common to all points
    Vec3d up = Vec3d::Zero();            // unit, against the common acceleration; 0 if that is 0
    int index = 0;                       // from 0
    int iterations = 1;

    // How directly a shape supports each point: 255 if it touches one, one less for each point in between, 0 without
    // support. From the previous substep; next_support is filled as contacts are solved.
    std::span<const std::uint8_t> support;
    std::span<std::uint8_t> next_support;
    // m/s: velocity of the point's support, if it has one. Empty if all supports are at rest.
    std::span<const Vec3d> support_v;
    std::span<Vec3d> next_support_v;

    std::size_t size() const { return points.size(); }
    Mobility mobility_of(std::size_t i) const { return mobility.empty() ? Mobility{dt, 0.5 * dt * dt} : mobility[i]; }
    bool lives(std::size_t i) const { return dead.empty() || !dead[i]; }
};

// The rows of one constraint, over the substeps of a frame. Called from one thread. May use others, but results must
// be bit-identical for any number of threads.
class Coupling {
public:
    virtual ~Coupling() = default;

    // Is called before the first substep. Declares which points stay awake, and which fall asleep and wake together
    // (sleep.h). Null if no point may sleep in this frame. By default all points stay awake.
    virtual void join(Sleep* sleep);

    // Returns true if it has two-sided rows, which act with forces. Substep::displacement is then filled.
    virtual bool has_forces() const { return false; }
    // Returns true if it has impacts to solve.
    virtual bool bounces() const { return false; }

    // Returns the radii of the points whose contact forces it records and 0 for others; empty if it records none.
    virtual std::span<const float> recorded() const { return {}; }

    // Returns the radii at which its points meet one another, m; empty if they do not.
    virtual std::span<const float> radii() const { return {}; }
    // Returns the material by which it turns points; null if it turns none.
    virtual const ContactMaterial* turns() const { return nullptr; }

    // Returns true if it can only take energy from points.
    virtual bool only_dissipates() const { return false; }
    // Returns true if it moves points, or the ends of springs, by itself.
    virtual bool is_driven() const { return false; }
    // Marks points whose motion it prescribes in the frame: nothing else moves them.
    virtual void prescribe(std::span<std::uint8_t>) const {}
    // Returns true if it acts by impulses between points only.
    virtual bool keeps_momentum() const { return false; }
    // Adds the energy stored in its rows, J times the factor, to one point of each row; at the beginning of the
    // substep or at the current positions.
    virtual void add_stored_energy(const Substep&, std::span<const Vec3d>, double, std::span<double>) const {}
    // Adds the pairs of points, the lower index first, that it joins so that contacts leave them alone.
    virtual void add_joined(std::vector<std::array<std::uint32_t, 2>>&) const {}
    // Links the points that have exchanged energy in the substep.
    virtual void link(EnergyIslands&) const {}
    // Drops the row forces on marked points, which something else has moved, and moves these towards positions that
    // satisfy its rigid rows. The marks are 1 or 0 by point.
    virtual void yield(Substep&, std::span<const std::uint8_t>) {}

    // Called in this order; see above.
    virtual void move_kinematic(Substep&) {}
    virtual void advance(Substep&) {}
    virtual void detect(Substep&) {}
    // Runs one sweep, numbered from 1, over the changes of the previous one. Returns false if nothing was hit.
    virtual bool solve_impacts(Substep&, std::uint32_t) { return false; }
    virtual void warm_start(Substep&) {}
    virtual void project(Substep& step) = 0;
    virtual void solve_velocities(Substep&) {}
    virtual void add_forces(const Substep&) {}
    virtual void correct_penetration(Substep&) {}

    // Ends the last substep: stores the state that the next frame starts with, and counts the rows and their errors.
    virtual void close(Substep& step, FrameFigures& figures) = 0;
};

// The object that a constraint node adds. It lives for one frame; persistent state belongs to its node.
class Constraint : public Dynamic {
public:
    // Is called before a frame, on one thread, with the points at their initial positions. Applies only to `group`.
    // Returns null if there is nothing to do.
    virtual std::shared_ptr<Coupling> begin(const PointSet& points, double frame_length) const = 0;

    // Returns the radius, m, that it gives its points if that is not the attribute pscale. Shapes keep the points at
    // that distance, too (step_context.h).
    virtual std::optional<PerPoint<float>> radius() const { return std::nullopt; }

    // Returns the number of substeps, with one iteration each, that its points need to hold each other through a frame
    // of h seconds. acceleration: m/s², common to all points. 1 by default.
    virtual double needed_substeps(const PointSet&, const Vec3d& /*acceleration*/, double /*h*/) const { return 1; }

    // Returns true if points were created so deep inside each other in the last frame that they still overlap.
    virtual bool births_overlap() const { return false; }

    // Returns an equivalent constraint with its own memory, which solves the same frames a second time. Its memory
    // continues that of `before`, the twin of the previous frame, or copies that of this constraint if `before` is
    // null. Returns null if no twin exists; the error of its points is then not estimated.
    virtual std::shared_ptr<const Constraint> twin(const Constraint*) const { return nullptr; }
};

// Constraints that hold single points by isotropic springs.
//
// Under an impulse p from contacts, shapes or rods, a spring of softness s (Row::keep) yields by
//
//   w p dt / (1 + w/s)      like a point of inverse mass 1/(1/w + 1/s)
//
// and its point has that mass while these act, so they account for the spring's support at once. Row by row, a heavy
// point on a light one that is held would take iterations in proportion to the mass ratio.

// An interface that such a Coupling also implements.
class Holding {
public:
    virtual ~Holding() = default;

    // Is called before detect(). Makes the points count as heavier from here on.
    virtual void hold(Substep& step) = 0;
    // Is called after project(). Updates the springs' forces with the result.
    virtual void settle(Substep& step) = 0;
    // Is called after solve_velocities(). Restores the points' masses.
    virtual void release(Substep& step) = 0;
};

// Returns a copy of `constraint` that continues the `memory` of `before`, or a copy of its own memory if `before` is
// null.
template <class C, class Memory>
std::shared_ptr<const Constraint> twin_of(const C& constraint, std::shared_ptr<Memory> C::*memory,
                                          const Constraint* before)
{
    auto twin = std::make_shared<C>(constraint);
    const auto* known = dynamic_cast<const C*>(before);
    twin.get()->*memory = known ? known->*memory : std::make_shared<Memory>(*(constraint.*memory));
    return twin;
}

// Interface of a constraint that saves and loads its memory.
class Remembering {
public:
    virtual ~Remembering() = default;
    virtual void save(StateWriter& to) const = 0;
    virtual void load(StateReader& from) const = 0;
};

// Base of a constraint C whose memory belongs to its node.
template <class C, class Memory>
class RememberingConstraint : public Constraint, public Remembering {
public:
    std::shared_ptr<Memory> memory;

    std::shared_ptr<const Constraint> twin(const Constraint* before) const override
    {
        return twin_of<C, Memory>(static_cast<const C&>(*this), &C::memory, before);
    }
    void save(StateWriter& to) const override { to(*memory); }
    void load(StateReader& from) const override { from(*memory); }
};

}  // namespace rapid

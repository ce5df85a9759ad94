// Constraints between points (paper §5): the interface that a constraint node implements, for Solve to project.
//
// A Constraint is what a node adds to the points that travel down a chain. At each frame it gives the solver a
// Coupling: its rows, which are scalar constraints C(x) = 0 or C(x) >= 0 over a few points each, with their impulses. A
// sub-step (numerics.md, Constraints):
//
//   x~ = P + v dt + a dt²/2         free motion: each point by its forces, actions and collisions
//   move_kinematic()                points whose positions are prescribed
//   advance()                       points that rods and springs link move by those forces, too
//   detect()                        finds the rows of this sub-step, as contacts
//   solve_impacts()                 restitution, at the times of impacts within the sub-step, until none is left
//   warm_start()                    applies the impulses of the last sub-step
//   project()                       P = x~ + Δx by Gauss-Seidel, `iterations` times; Δx = w ∇C p dt
//   v + Δx/dt                       never the difference of stored positions
//   solve_velocities()              friction; what is left along rigid rows; rows that break; beside shapes and rods
//                                   `iterations` times
//   add_forces()                    records the impulses, where Substep::forces is there
//   correct_penetration()           what is left too deep after all shapes
//
// w is the inverse mass times v_of_a / dt, with v_of_a the mobility of the velocity under drag and springs: so that
// what lies on another under drag is borne by its weight. Rods and springs take both mobilities, which is exact.
//
// Most constraints need only a residual and its gradient: rows.h makes a Coupling of these.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/projected_point.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/forces.h"

namespace rapid {

class ContactForces;
class EnergyIslands;
class Sleep;
class StepLog;
struct ContactMaterial;
struct Spin;

// The coupled points of a set in one sub-step; shapes [size].
struct Substep {
    std::span<ProjectedPoint> points;      // from the end of their free motion on
    std::span<Vec3d> v;                    // m/s, at the end of the sub-step
    std::span<Vec3d> start;                // positions at its beginning; moved by what corrects positions alone
    std::span<const Vec3d> born;           // the same before anything was moved out of shapes; empty where none can be
    std::span<const double> energy;        // J, of motion and forces at its beginning; empty as mobility is
    std::span<const std::uint8_t> dead;    // 1: takes no part any more; empty where none can have died
    std::span<const double> inverse_mass;  // 1/kg; 0 of points that do not move by themselves
    std::span<const Mobility> mobility;    // empty where no force has a linear part
    std::span<const SurfaceSpring> surface_springs;  // empty as mobility is; a w2 of 0 where a point has none
    // m: of each point that moves, by its acceleration up to its velocity at the end; collisions aside. Empty unless
    // some constraint has forces.
    std::span<Vec3d> displacement;
    // m/s, of points that shapes carry, where the sub-step began; 0 of others. Empty where there is no shape.
    std::span<const Vec3d> carried_v;
    std::span<FreePath> paths;  // empty where nothing bounces
    // m/s: what shapes have changed the velocity of each point by in its free motion. Empty where nobody asks.
    std::span<Vec3d> reaction;
    std::span<Spin> spins;               // empty where no point turns
    ContactForces* forces = nullptr;     // null where they are not recorded
    StepLog* log = nullptr;              // null where nobody asks
    bool is_shared = false;              // contacts, shapes or other constraints act, too, beside a constraint
    double dt = 0;                       // s, of a point that lives through the whole frame
    double time = 0;                     // s since the start, at its end
    double max_acceleration = 0;         // m/s², by forces
    Vec3d acceleration = Vec3d::Zero();  // m/s², that is the same for all
    Vec3d up = Vec3d::Zero();            // unit, against the acceleration that is the same for all; 0 where that is 0
    int index = 0;                       // from 0
    int iterations = 1;

    // How directly a shape supports each point: 255 where it touches one, one less for each point between, 0 without
    // support. Of the sub-step before; and of this one, as contacts are solved.
    std::span<const std::uint8_t> support;
    std::span<std::uint8_t> next_support;
    // m/s: of what supports a point, where something does. Empty where all that does is at rest.
    std::span<const Vec3d> support_v;
    std::span<Vec3d> next_support_v;

    std::size_t size() const { return points.size(); }
    Mobility mobility_of(std::size_t i) const { return mobility.empty() ? Mobility{dt, 0.5 * dt * dt} : mobility[i]; }
    bool lives(std::size_t i) const { return dead.empty() || !dead[i]; }
};

// How well a frame's rows are satisfied; and of contacts, how their pairs were found.
struct Residual {
    double worst = 0;          // m
    std::uint64_t rows = 0;    // that are active
    std::uint64_t loose = 0;   // of them, those that are off by more than a tenth of their size
    std::uint64_t broken = 0;  // rows that broke in the frame

    struct Search {
        std::vector<std::size_t> grids;  // the points in each, from coarse to fine
        double error = 0, excess = 0;    // of their cells (RadiusGrids)
        double seconds = 0;
    };
    std::optional<Search> search;
};

// The rows of one constraint, over the sub-steps of a frame. Called from one thread; may use others, and must come to
// the same bits on any number of them.
class Coupling {
public:
    virtual ~Coupling() = default;

    // Before the first sub-step: declares which points stay awake, and which fall asleep and wake together (sleep.h).
    // Null where no point may sleep in this frame. By default all points stay awake.
    virtual void join(Sleep* sleep);

    // Whether it has two-sided rows, which act with forces: then Substep::displacement is there.
    virtual bool has_forces() const { return false; }
    // Whether it has impacts to solve.
    virtual bool bounces() const { return false; }

    // The radii of the points whose contact forces it records, 0 of others; empty where it records none.
    virtual std::span<const float> recorded() const { return {}; }

    // What it turns points by; null where it turns none.
    virtual const ContactMaterial* turns() const { return nullptr; }

    // Whether all that it does to points takes energy from them.
    virtual bool only_dissipates() const { return false; }
    // Whether it moves points, or the ends of springs, by itself.
    virtual bool is_driven() const { return false; }
    // Marks points whose motion it prescribes in the frame: nothing else moves them.
    virtual void prescribe(std::span<std::uint8_t>) const {}
    // Whether what it does to points are impulses between them alone.
    virtual bool keeps_momentum() const { return false; }
    // Adds the energy that its rows have stored, J times the factor, to that of one of their points each; at the
    // beginning of the sub-step, or where points are now.
    virtual void add_stored_energy(const Substep&, std::span<const Vec3d>, double, std::span<double>) const {}
    // Links the points between which energy has gone to and fro in the sub-step.
    virtual void link(EnergyIslands&) const {}
    // Forgets the forces of rows on these points, which have moved otherwise, and moves them towards where its rigid
    // rows are satisfied. By point: 1, or 0.
    virtual void yield(Substep&, std::span<const std::uint8_t>) {}

    // In the order of the calls; see above.
    virtual void move_kinematic(Substep&) {}
    virtual void advance(Substep&) {}
    virtual void detect(Substep&) {}
    // One sweep, numbered from 1, over what the sweep before has changed. False where nothing is hit.
    virtual bool solve_impacts(Substep&, std::uint32_t) { return false; }
    virtual void warm_start(Substep&) {}
    virtual void project(Substep& step) = 0;
    virtual void solve_velocities(Substep&) {}
    virtual void add_forces(const Substep&) {}
    virtual void correct_penetration(Substep&) {}

    // The last sub-step is over: keeps what the next frame begins with.
    virtual Residual close(Substep& step) = 0;
};

// What a constraint node adds. Lives for a frame; what it has to remember belongs to its node.
class Constraint : public Dynamic {
public:
    // Before a frame, on one thread, with the points where they begin it. Limits itself to `group`. Null where there is
    // nothing to do.
    virtual std::shared_ptr<Coupling> begin(const PointSet& points, double frame_length) const = 0;

    // The radius, m, that it gives its points, where it is not the attribute pscale: shapes keep them at that distance,
    // too (collision_radii.h).
    virtual std::optional<PerPoint<float>> radius() const { return std::nullopt; }

    // A constraint like this one that remembers for itself, to solve the same frames a second time: what `before` does,
    // the twin of the frame before, or where that is null a copy of what this one does. Null where there is none: then
    // the error of its points is not estimated.
    virtual std::shared_ptr<const Constraint> twin(const Constraint*) const { return nullptr; }
};

}  // namespace rapid

// What couples the motions of points: the one interface of all constraints (paper §5), for Solve to project.
//
// A Constraint is what a node adds to the points that travel down a chain. At each frame it gives the solver a
// Coupling, which holds its rows: residuals over a few points each, with their gradients. The solver calls the
// couplings, and knows none by its kind. A sub-step is (numerics.md, Constraints; Macklin et al. 2014, 2016)
//
//   x~ = P + v dt + a dt²/2         each point by itself, by all that acts on it: forces, actions, shapes
//   resume(), hold(), rouse()       points whose place is given; which rows there are, and whom they wake
//   prepare()                       what the rows did before
//   project()                       P = x~ + Δx, as often as the solve has iterations; Δx = w ∇C Δλ
//   v+ = v + a dt + Δx/dt           never the difference of stored positions
//   suspend()                       v+ + Δx/(2dt) between sub-steps: 0 at rest
//   settle()                        velocities: friction, restitution
//   take_back()                     what shapes have had the last word on, and has come out too far off
//
// w is the inverse mass times v_of_a / dt, with v_of_a what a constant acceleration does to the velocity of a point
// that drag and springs hold back: so that what hangs from a constraint under drag stretches it as its weight does.
//
// Most constraints need none of this but a residual: rows.h makes a Coupling of it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

// Where a point is, m, and its inverse mass, 1/kg: 0 for one that no constraint moves, or that sleeps. A cache line
// holds two.
struct alignas(32) Place {
    Vec3d P;
    double w;
};

// What a constant acceleration (1 m/s²) does to a point in a sub-step, m/s and m: dt and dt²/2, but for drag and
// springs.
struct Yield {
    double v, x;
};

// The coupled points of a set in one sub-step; shapes [size].
struct Substep {
    std::span<Place> at;                 // from the end of their free ways on
    std::span<Vec3d> v;                  // m/s, at the end of the sub-step
    std::span<const Vec3d> begin;        // where they were at its beginning
    std::span<const std::uint8_t> dead;  // 1: takes no part any more; empty where nobody can have died
    std::span<const Yield> yields;       // empty where no force has a linear part
    double dt = 0;                       // s, of a point that lives through the whole frame
    double time = 0;                     // s since the start, at its end
    double pull = 0;           // m/s², the largest acceleration by forces: what a point at rest is pressed by
    Vec3d up = Vec3d::Zero();  // unit, against the sum of what is the same for all points, as gravity; 0 where it is 0
    int index = 0;             // from 0
    int iterations = 1;
    Sleepers* sleepers = nullptr;  // null where nobody may sleep

    // How near each is to a shape that bears it: 255 where it touches one, one less for each point between, 0 where
    // nothing bears it. Of the sub-step before; and of this one, as it is found.
    std::span<const std::uint8_t> borne;
    std::span<std::uint8_t> found_borne;

    std::size_t size() const { return at.size(); }
    Yield yield_of(std::size_t i) const { return yields.empty() ? Yield{dt, 0.5 * dt * dt} : yields[i]; }
    bool lives(std::size_t i) const { return dead.empty() || !dead[i]; }
    bool asleep(std::size_t i) const { return sleepers && sleepers->asleep(i); }
};

// How well a frame's rows are satisfied; and of contacts, how their pairs were found.
struct Residual {
    double worst = 0;         // m
    std::uint64_t rows = 0;   // that are active
    std::uint64_t loose = 0;  // of them, those that are off by more than a tenth of their size

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

    // Places and velocities become those that the projection starts from: without half of what the rows did in the
    // sub-step before, which suspend() adds again. So velocities between sub-steps are what they seem, 0 at rest, and
    // what others settle is all of them.
    virtual void resume(Substep&) {}
    virtual void suspend(Substep&) {}

    virtual void hold(Substep&) {}
    virtual void rouse(Substep&) {}
    virtual void prepare(Substep&) {}
    virtual void project(Substep& now) = 0;
    virtual void settle(Substep&) {}
    virtual void take_back(Substep&) {}

    // Before the first sub-step: sets to 1 the points that are not to sleep in this frame. All, but where a coupling
    // knows better.
    virtual void tie(std::span<std::uint8_t> tied) const { std::fill(tied.begin(), tied.end(), std::uint8_t{1}); }
    // And which of them are to fall asleep and wake as one.
    virtual void bind(Islands&) const {}

    // The last sub-step is over. What the next frame begins with is kept.
    virtual Residual close(Substep& now) = 0;
};

// What a constraint node adds. Lives for a frame; what it has to remember belongs to its node.
class Constraint : public Dynamic {
public:
    // Before a frame, on one thread, with the points where they begin it. Limits itself to `group`. Null where there is
    // nothing to do.
    virtual std::shared_ptr<Coupling> begin(const PointSet& points, double frame_length) const = 0;
};

}  // namespace rapid

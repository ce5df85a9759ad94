// Advances points by one frame: forces, integration, collision, at each sub-step (paper §2.1, §2.3, §4).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/collision/contact_energy.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

struct Obstacle;
struct ShapeLoads;

struct SolveOptions {
    int substeps = 1;
    double time = 0;         // s since the start, at the end of the frame
    double h = 0;            // s, the frame's length
    std::int64_t frame = 0;  // its number, for messages
    std::string group;       // only these points are advanced; all when empty
    // Set to 1 for points that meet a shape, by their place before the step; null: nobody asks.
    std::uint8_t* met = nullptr;
    bool begins_frame = true;  // no step of this frame was before: contacts are counted from 0

    int iterations = 1;           // of the constraints, a sub-step
    ShapeLoads* loads = nullptr;  // kept from frame to frame where points are coupled; null: each begins anew

    // s after which points at rest sleep, where they have the column `still`; and what is kept from frame to frame
    double sleep = std::numeric_limits<double>::infinity();
    SleepMemory* beds = nullptr;
};

struct SolveResult {
    std::uint64_t collisions = 0;     // contacts
    std::uint64_t contact_limit = 0;  // points that ran into the limit of contacts in a step
    std::uint64_t trapped = 0;        // points deep in a shape, with no way out known
    double penetration_max = 0;       // m, the deepest at the end of the frame
    ContactEnergy contact_energy;
    std::uint64_t died = 0;    // points that actions killed
    Residual residual;         // of the constraints, at the end of the frame
    std::uint64_t asleep = 0;  // points, at the end of the frame
};

// How a point went through the frame.
enum class Way : std::uint8_t {
    Exact,   // by a closed form for the whole of it, which sub-steps would only repeat
    Smooth,  // by forces alone: of second order
    Acted,   // with actions: of first order, or second
    Broken,  // it has met a shape
};

// What the points of a block have come to in a run through the frame; spans have shape [n].
struct RunEnd {
    std::span<const std::uint32_t> places;  // in the set
    std::span<const Way> way;
    std::span<const double> put_off;     // by contacts that were found after a sub-step, m
    std::span<const std::uint8_t> dead;  // 1: it has died; empty where none can
    std::span<const Vec3d> P, v;         // before they are rounded to single precision
    std::span<const Vec3f> rounded;      // P, on the outer side of what it lies on
    std::span<const Obstacle> obstacles;
};

// Takes the ends of one block after the other.
class BlockRuns {
public:
    virtual ~BlockRuns() = default;

    // A block begins: the points at these places of the set.
    virtual void begin(std::span<const std::uint32_t> places) = 0;
    // How many sub-steps to go through the frame with once more, from where the points were at first; 0: no more.
    virtual int take(const RunEnd& end) = 0;
};

// What goes through the frame with the points of a set, block by block while it is in cache, and as often as it wants
// to. What an action or a recorded hit writes stays: with these it goes only once.
class Runs {
public:
    virtual ~Runs() = default;

    // Whether points may be moved at once whose way through the frame is known in closed form.
    virtual bool takes_exact() const = 0;
    virtual std::unique_ptr<BlockRuns> begin() = 0;  // from any thread
};

// Advances P and v of every point by its own time: the column `dt` where the points have one (s; a newborn's is its age
// at the end of the frame), else h; and where they have a `force` (N), by force / mass besides, which is then cleared.
// Points that an action kills are removed. Ages, other deaths and ids are the caller's.
//
// With constraints the sub-step is the barrier: all points take it, and then their couplings are projected. A point of
// infinite mass is moved by its own velocity alone, and so is one that is not of the group.
//
// Same bits for any number of threads, any chunk, and whichever other points there are that it is not coupled to.
// Error: a velocity or position that is not finite before or after, with the point's id, or a force that is not, with
// its node; a collider or force whose attribute is missing. Of several points the one nearest to the beginning of the
// set is named.
SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// The same of points that nothing couples, where the ends of all blocks are handed to `runs`, and nothing else is done
// to P, v, `force` and the dead. What is counted is of the first run of each; the deepest is of all.
SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Runs& runs);

// Whether the ways of all points have a closed form for the whole frame, which sub-steps would only repeat.
bool is_closed_form(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

}  // namespace rapid

// Advances points by one frame: forces, integration, collision and constraints, at each substep (paper §2.1, §2.3,
// §4).
//
//   step_context   what the blocks share: columns, the dynamics of the chain, resolved for the points, and counts
//   solve          without constraints: each block goes through the whole frame while it is in cache
//   coupled_step   with constraints: the substep is the barrier
//   block_step     one substep of a block: forces, motion, collision, actions
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/figures.h"

namespace rapid {

class Refinement;
class StepLog;
struct ShapeLoads;

// Where the solver writes what observers need from within the step. Each is null if nobody requests it.
struct StepSinks {
    std::uint8_t* met = nullptr;    // set to 1 for points that touch a shape, by index before the step
    std::int32_t* taken = nullptr;  // with a tolerance: set to the substeps of each point's result, by the same index
    StepLog* log = nullptr;         // receives contacts, breaks and deaths
};

struct SolveOptions {
    int substeps = 1;
    double time = 0;         // s since the start, at the end of the frame
    double h = 0;            // s, the frame's length
    std::int64_t frame = 0;  // number of the frame, for messages
    std::string group;       // only these points are advanced; all if empty
    StepSinks sinks;
    bool begins_frame = true;  // the first step of the frame: contacts are counted from 0

    // Neighbours act on each other at every substep (interaction.h); otherwise not within solve().
    bool interacts = false;

    int iterations = 1;           // of the constraints, per substep
    ShapeLoads* loads = nullptr;  // warm starts of coupled points, stored between frames; null: none

    // s after which points at rest sleep, if they have the column `still`; and the records stored between frames
    double sleep = std::numeric_limits<double>::infinity();
    SleepRecords* sleep_records = nullptr;
};

// Advances P and v of every point by its own time: the column `dt` if the points have one (s; a newborn's is its age
// at the end of the frame), else h. A `force` (N) acts too, and is then cleared. Points that an action kills are
// removed. Ages, other deaths and ids are left to the caller.
//
// Constraints do not move a point of infinite mass, which moves only by its own velocity, nor a point outside the
// group, which does not move at all.
//
// The result for a point is bit-identical for any number of threads, any chunk size, and any other points that it is
// not coupled to. Throws Error if a velocity or position is not finite before or after, with the point's id; if a
// force is not finite, with its node; or if an attribute of a collider or force is missing. Among several points, the
// first one in the set is named.
FrameFigures solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// The same without constraints, with the results of all blocks passed to `refinement` instead of being stored: P, v,
// `force` and the dead are left to it. Counts are those of the first run of each block; the penetration is the largest
// of all runs.
FrameFigures solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Refinement& refinement);

// Returns true if the paths of all points have a closed form for the whole frame, which substeps would only repeat.
bool is_closed_form(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// Repeated steps with increasing substeps, block by block while the block is in cache: the interface through which
// error control (estimate/error_control.h) drives solve().

struct Obstacle;

// The kind of a point's path through the frame, by how its error decreases with the substeps.
enum class PathKind : std::uint8_t {
    Exact,   // a closed form for the whole frame: substeps would only repeat it
    Smooth,  // forces alone: second order
    Acted,   // actions as well: first or second order
    Broken,  // by contacts
};

// A block at the end of the frame; spans have shape [n].
struct BlockResult {
    std::span<const std::uint32_t> indices;  // in the set
    std::span<const PathKind> path;
    std::span<const double> position_errors;  // m, due to contacts found after a substep
    std::span<const std::uint8_t> dead;       // 1: it has died; empty if none can
    std::span<const Vec3d> P, v;              // before rounding to single precision
    std::span<const Vec3f> rounded;           // P, on the outer side of the point's surface
    std::span<const Obstacle> obstacles;
};

// Refines one block after another.
class BlockRefinement {
public:
    virtual ~BlockRefinement() = default;

    // Begins the next block: the points at these indices of the set.
    virtual void begin(std::span<const std::uint32_t> indices) = 0;
    // Takes the result of a run. Returns the substeps of the next run, from the beginning of the frame, or 0.
    virtual int take(const BlockResult& result) = 0;
};

// Columns that actions and recorded hits write are not restored between the runs, so a block with those can run only
// once.
class Refinement {
public:
    virtual ~Refinement() = default;

    // Returns true if points with a path in closed form are advanced immediately, without a run.
    virtual bool takes_exact() const = 0;
    virtual std::unique_ptr<BlockRefinement> begin() = 0;  // from any thread
};

}  // namespace rapid

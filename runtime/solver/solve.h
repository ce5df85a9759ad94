// Advances points by one frame: forces, integration, collision and constraints, at each sub-step (paper §2.1, §2.3,
// §4).
//
//   step_scene       the dynamics of the chain, resolved for the points
//   uncoupled_step   without constraints: each block goes through the whole frame while it is in cache
//   coupled_step     with constraints: the sub-step is the barrier
//   block_step       one sub-step of a block: forces, motion, collision, actions
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "runtime/points/point_set.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/ledger.h"

namespace rapid {

class Refinement;
class StepLog;
struct ShapeLoads;

struct SolveOptions {
    int substeps = 1;
    double time = 0;         // s since the start, at the end of the frame
    double h = 0;            // s, the frame's length
    std::int64_t frame = 0;  // its number, for messages
    std::string group;       // only these points are advanced; all when empty
    // Set to 1 for points that touch a shape, by their place before the step; null where nobody asks.
    std::uint8_t* met = nullptr;
    // With a tolerance: set to the sub-steps of each point's result, by its place before the step; null where nobody
    // asks.
    std::int32_t* taken = nullptr;
    StepLog* log = nullptr;    // receives contacts and deaths; null where nobody asks
    bool begins_frame = true;  // the first step of the frame: contacts are counted from 0

    // Neighbours act on each other at every sub-step (interaction.h); else not at all in here.
    bool interacts = false;

    int iterations = 1;           // of the constraints, per sub-step
    ShapeLoads* loads = nullptr;  // warm starts of coupled points, kept from frame to frame; null: none

    // s after which points at rest sleep, where they have the column `still`; and what is kept from frame to frame
    double sleep = std::numeric_limits<double>::infinity();
    SleepRecords* sleep_records = nullptr;
};

struct SolveResult {
    std::uint64_t collisions = 0;     // contacts
    std::uint64_t contact_limit = 0;  // points that ran into the limit of contacts in a step
    std::uint64_t trapped = 0;        // points deep in a shape, with no way out known
    double penetration_max = 0;       // m, the deepest at the end of the frame
    ContactEnergy contact_energy;
    std::optional<Ledger> ledger;  // where points are constrained
    std::uint64_t died = 0;        // points that actions killed
    Residual residual;             // of the constraints, at the end of the frame
    std::uint64_t asleep = 0;      // points, at the end of the frame
};

// Advances P and v of every point by its own time: the column `dt` where the points have one (s; a newborn's is its age
// at the end of the frame), else h. Where they have a `force` (N), it acts too, and is then cleared. Points that an
// action kills are removed. Ages, other deaths and ids are the caller's.
//
// A point of infinite mass, or outside the group, is not moved by constraints: by its own velocity alone, or not at
// all.
//
// Same bits for any number of threads, any chunk size, and whichever other points there are that it is not coupled to.
// Error: a velocity or position that is not finite before or after, with the point's id, or a force that is not, with
// its node; a collider or force whose attribute is missing. Of several points the first one in the set is named.
SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// The same without constraints, where the results of all blocks are handed to `refinement` instead of being stored:
// P, v, `force` and the dead are left to it. Counts are those of the first run of each block; the penetration is the
// deepest of all runs.
SolveResult solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Refinement& refinement);

// Whether the paths of all points have a closed form for the whole frame, which sub-steps would only repeat.
bool is_closed_form(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

}  // namespace rapid

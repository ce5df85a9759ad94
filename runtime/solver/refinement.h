// Repeated steps with increasing substeps, block by block while the block is in cache: the interface through which
// error control (estimate/error_control.h) drives solve().
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/math/vec.h"

namespace rapid {

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

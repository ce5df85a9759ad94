// Repeated steps with more and more sub-steps, block by block while the block is in cache: the interface by which error
// control (estimate/error_control.h) steers solve().
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/math/vec.h"

namespace rapid {

struct Obstacle;

// The path of a point through the frame, by how its error falls with the sub-steps.
enum class PathKind : std::uint8_t {
    Exact,   // a closed form for the whole frame: sub-steps would only repeat it
    Smooth,  // forces alone: second order
    Acted,   // actions, too: first or second order
    Broken,  // by contacts
};

// A block at the end of the frame; spans have shape [n].
struct BlockResult {
    std::span<const std::uint32_t> places;  // in the set
    std::span<const PathKind> path;
    std::span<const double> put_off;     // m, by contacts found after a sub-step
    std::span<const std::uint8_t> dead;  // 1: it has died; empty where none can
    std::span<const Vec3d> P, v;         // before rounding to single precision
    std::span<const Vec3f> rounded;      // P, on the outer side of the surface that it lies on
    std::span<const Obstacle> obstacles;
};

// Refines one block after the other.
class BlockRefinement {
public:
    virtual ~BlockRefinement() = default;

    // The next block: the points at these places of the set.
    virtual void begin(std::span<const std::uint32_t> places) = 0;
    // Takes the result of a run; returns the sub-steps of the next one, again from the beginning of the frame, or 0.
    virtual int take(const BlockResult& result) = 0;
};

// Columns that actions and recorded hits write are not restored between the runs: with those, a block can run only
// once.
class Refinement {
public:
    virtual ~Refinement() = default;

    // Whether points with a path in closed form are advanced at once, without a run.
    virtual bool takes_exact() const = 0;
    virtual std::unique_ptr<BlockRefinement> begin() = 0;  // from any thread
};

}  // namespace rapid

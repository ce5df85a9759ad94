// Data shared by the blocks of a step: the columns of the points, the scene, and the counts.
#pragma once

#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/collision/collisions.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/constraints/projection.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/figures.h"
#include "runtime/solver/motion/ballistic_batch.h"
#include "runtime/solver/point_errors.h"
#include "runtime/solver/solve.h"

namespace rapid {

// The radii at which points collide with shapes, m: those of the collider; otherwise the attribute pscale; if that is
// 0 or missing, the radius from a constraint. Points that keep each other at a distance thus have the same size for
// shapes.
class CollisionRadii {
public:
    // Throws Error, with the node, if a constraint's attribute is missing.
    CollisionRadii(const Dynamics& dynamics, const PointSet& points);

    // Valid while this object, the collider and the points' columns exist.
    Strided<float> of(const Collider& collider) const;

private:
    const PointSet* points_;
    std::vector<float> by_constraint_;  // pscale, or from constraints; empty if these give nothing
};

// The dynamics of a chain, resolved for one set of points and one step: uniform forces summed, parameters and groups
// looked up as columns.

// A force that varies between points, or acts only on a group.
struct StepForce {
    const Force* force;
    std::optional<Uniform> uniform;
    Strided<std::uint8_t> members;
    bool all;
};

struct StepAction {
    const Action* action;
    std::unique_ptr<ActionPass> pass;
};

struct StepScene {
    // Throws Error, with the node, for the first dynamic in the chain that does not fit the points.
    StepScene(PointSet& points, const Dynamics& dynamics, double h);

    std::vector<StepAction> actions;
    Uniform uniform;  // the sum of all uniform forces on all points
    std::vector<StepForce> forces;
    std::optional<CollisionRadii> radii;  // of the obstacles
    std::vector<Obstacle> obstacles;
    std::vector<LocalConstraint> constraints;
    bool kills = false, records = false;   // some collider kills, or records hits
    const Column<Vec3f>* force = nullptr;  // the column `force`; null if it is zero
    Strided<float> mass;                   // kg

    bool is_uniform() const { return forces.empty() && !force; }
    // Returns true if points far from shapes have a path in closed form for the whole frame.
    bool is_ballistic() const;
};

// Returns true if motion under a constant acceleration and these linear forces has a closed form for the whole frame.
inline bool has_closed_form(const Linear& linear) { return linear.w2 == 0 && linear.c == 0; }

// Returns the column `force`; null if it is missing or zero everywhere.
const Column<Vec3f>* nonzero_forces_of(const PointSet& points);

// Number of points that go through their substeps together: their state, paths and contacts stay in the first and
// second-level caches. A chunk, the unit of work of a thread, has several blocks.
constexpr std::size_t block_size = 256;

class StepContext {
public:
    StepContext(PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

    PointSet& points;
    const SolveOptions& options;
    const StepScene scene;
    const std::span<Vec3f> P, v;     // at the beginning of the frame, until the result is stored
    OwnTime time;                    // s, of each point in the frame
    std::vector<std::uint8_t> dead;  // 1: killed by an action or a collider; empty if none can kill
    const PointErrors errors;

    // Return true if the step advances a point: those outside options.group stay in place.
    bool advances_all() const { return !members_.data; }
    bool advances(std::size_t i) const { return !members_.data || members_[i]; }
    CollisionContext collision_context();

    // Calls f(begin, end) for each chunk, in parallel. Throws the Error of the first failing chunk.
    template <class F>
    void for_each_chunk(const F& f);

    // Adds the figures of a chunk; first: one of its points. May be called from any thread.
    void count(FrameFigures of_chunk, std::size_t first);

    void remove_dead();
    FrameFigures& figures() { return figures_; }
    // Returns the figures of the step after all chunks are counted.
    FrameFigures take_figures();

private:
    Strided<std::uint8_t> members_{nullptr, 0};  // of options.group; null for all
    std::optional<Hits> hits_;
    std::optional<StuckColumns> stuck_;

    std::mutex mutex_;
    FrameFigures figures_;
    std::vector<std::pair<std::size_t, ContactEnergy>> energies_;  // keyed by a point of the chunk
    std::exception_ptr error_;
    std::size_t failed_ = 0;  // the beginning of the chunk in which error_ was thrown
};

template <class F>
void StepContext::for_each_chunk(const F& f)
{
    const auto guarded = [&](std::size_t begin, std::size_t end) {
        try {
            f(begin, end);
        } catch (...) {
            const std::scoped_lock lock(mutex_);
            if (!error_ || begin < failed_) error_ = std::current_exception(), failed_ = begin;
        }
    };
    // Split small sets, too, such as shadows, so that all threads have work.
    const std::size_t n = points.size(), part = block_size * (n / (16 * block_size) + 1);
    rapid::for_each_chunk(n, guarded, std::min(part, chunk_size));
    if (error_) std::rethrow_exception(error_);
}

}  // namespace rapid

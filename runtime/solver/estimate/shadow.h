// How wrong the positions are, accumulated since each point's birth: a few points are carried along twice, and one of
// the two takes twice the sub-steps.
//
// The sample is every point while there are up to 1,000, and from then on those whose ids come first in a fixed random
// order: 1,000 to 1,250 of those alive when it is thinned out, whatever the threads. A shadow is born as its point is,
// and goes through Solve by itself, with finer steps. What the nodes between two Solves do to a point is done to its
// shadow as the same change of P and v: exact where they add, to first order where they depend on what they change.
// All other attributes are the point's. In a frame that is exact, and while no shadow is off its point, nothing is
// done.
//
// The estimate is twice the difference of the two: the error itself where halving the step halves it, 1.5 times it
// where that quarters it. A path that splits from its shadow, by a contact that one of them misses, is counted with all
// of its difference, and goes on being counted. Points that die in one of the two only are not.
#pragma once

#include <span>
#include <vector>

#include "runtime/solver/solve.h"

namespace rapid {

class Shadows {
public:
    // The points as they are before Solve: of those that were born since the last call some get a shadow. None has to
    // be advanced where finer steps would only repeat the frame and all shadows are where their points are.
    void begin(const PointSet& points, bool is_exact);

    // Advances the shadows as `solve_finer` does points. Afterwards: the estimated errors of P, m, in order of id.
    template <class F>
    std::vector<double> advance(const PointSet& solved, const F& solve_finer)
    {
        if (idle_) return std::vector<double>(solved.empty() ? 0 : 1, 0.0);
        if (ids_.empty()) return {};
        solve_finer(set_);
        return compare(solved);
    }

    // Of the points that have a shadow, in order of id: after begin() in the set that it was given, after advance() in
    // the one that it was given.
    std::span<const std::int64_t> ids() const { return ids_; }
    std::span<const std::uint32_t> places() const { return places_; }
    // These points before Solve, from begin() to advance().
    const PointSet& before() const { return before_; }
    // Whether nothing has to be done in this frame.
    bool idle() const { return idle_; }

private:
    std::vector<double> compare(const PointSet& solved);

    std::uint64_t threshold_ = UINT64_MAX;  // ids that come below it in the random order
    std::int64_t next_id_ = 0;              // ids below it have been looked at
    std::vector<std::int64_t> ids_;         // of the points that have a shadow, ascending
    std::vector<std::uint32_t> places_;     // where these points are, or were when they were looked for last
    std::vector<Vec3d> dP_, dv_;            // the shadow less its point, after Solve
    PointSet before_, set_;                 // these points and their shadows, from begin() to advance()
    bool off_ = false;                      // whether one of them is elsewhere than its point
    bool idle_ = false;                     // whether none has to be advanced in this frame
};

}  // namespace rapid

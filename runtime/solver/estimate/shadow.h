// Global error estimate by step halving: a sample of the points has shadows, which take twice the substeps, and the
// difference of point and shadow accumulates since the point's birth.
//
// The sample is every point while there are up to 1,000, and then the points whose ids come first in a fixed random
// order: 1,000 to 1,250 of those alive when it is thinned out, for any number of threads. A shadow is born with its
// point, and passes through Solve separately, with finer steps. Changes of P and v by nodes between two Solves are
// applied to the shadow as increments: exact if nodes add, to first order if they depend on the values they change.
// All other attributes are the point's. A frame that is solved exactly needs no work while every shadow is at its
// point.
//
// The estimate is twice the difference: the error itself if halving the step halves it, 1.5 times the error if that
// quarters it. A path that diverges from its shadow, because one of them misses a contact, counts with its whole
// difference from then on. Points that die in only one of the two do not count.
//
// Point and shadow share the rounding of positions to single precision, which is measured separately: the difference
// between the path at the frame's mean velocity and that between the rounded positions, modulo whole ulps, summed
// since birth. Exact under constant accelerations; on other paths as random as the rounding itself.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "runtime/points/state_archive.h"
#include "runtime/solver/solve.h"

namespace rapid {

class Shadows {
public:
    // Call before Solve: creates shadows for some of the points born since the last call. is_exact: finer steps would
    // only repeat the frame. h: s, the frame's length, for points without an individual time. arrives: returns true for
    // a point whose state after this step does not depend on that before it; its errors until now end.
    void begin(const PointSet& points, bool is_exact, double h = 0,
               const std::function<bool(const PointSet& points, std::size_t i)>& arrives = {});

    // Advances the shadows by `solve_finer`. Returns the estimated errors of P, m, in order of id.
    template <class F>
    std::vector<double> advance(const PointSet& solved, const F& solve_finer)
    {
        if (idle_) {
            find(solved);
            return std::vector<double>(solved.empty() ? 0 : 1, 0.0);
        }
        if (ids_.empty()) return {};
        solve_finer(set_);
        return compare(solved);
    }

    // The points with shadows, in order of id, and their indices in the set last passed to begin() or advance().
    std::span<const std::int64_t> ids() const { return ids_; }
    std::span<const std::uint32_t> indices() const { return indices_; }
    // The sampled points before Solve, from begin() to advance().
    const PointSet& before() const { return before_; }
    // Returns true if no shadow has to be advanced in this frame.
    bool idle() const { return idle_; }

    // Returns the largest displacement, m, of a sampled point by rounding since its birth, plus the half ulp to which
    // its position is known. touches: it may meet shapes, with which it is flush within two ulps.
    double rounding(bool touches) const;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(threshold_, next_id_, ids_, indices_, dP_, dv_, rounding_, off_);
        if constexpr (Archive::is_loading::value) {
            StateReader::expect(ascend(ids_));
            for (const std::size_t size : {indices_.size(), dP_.size(), dv_.size(), rounding_.size()})
                StateReader::expect(size == ids_.size());
        }
    }

private:
    // Per-point rounding: the state before Solve, with P after it; the time of motion, s; the displacement due to
    // rounding, m.
    struct Rounding {
        Vec3f P = Vec3f::Zero(), v = Vec3f::Zero();
        double dt = 0;
        Vec3d displacement = Vec3d::Zero();

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(P, v, dt, displacement);
        }
    };

    void find(const PointSet& solved);
    void add_rounding(const PointSet& solved);
    std::vector<double> compare(const PointSet& solved);

    std::uint64_t threshold_ = UINT64_MAX;  // the sample is the ids with a lower rank in the random order
    std::int64_t next_id_ = 0;              // ids below it have been considered
    std::vector<std::int64_t> ids_;         // of the points with shadows, ascending
    std::vector<std::uint32_t> indices_;    // indices when the points were last found
    std::vector<Vec3d> dP_, dv_;            // shadow minus point, after Solve
    std::vector<Rounding> rounding_;
    PointSet before_, set_;  // sampled points and their shadows, from begin() to advance()
    bool off_ = false;       // some shadow differs from its point
    bool idle_ = false;
};

}  // namespace rapid

// Sleep of points that rows hold together: finds sleeping rows and wakes their points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/row.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

template <class Function>
class RowSleep {
public:
    // Null if no point may sleep in this frame.
    void join(Sleep* sleep) { sleep_ = sleep; }

    using Row = rapid::Row<Function>;
    using Traits = FunctionTraits<Function>;

    // Begins a frame. check() wakes the points of rows that have changed, and of those whose residual differs from the
    // one at the end of the last frame, because a point that no row moves has then been moved.
    void begin() { disturbed_.clear(); }
    void check(Row& row, bool acts_otherwise, const PointSet& points)
    {
        if (Traits::rests && (acts_otherwise || (row.active && has_moved(row, points)))) disturb(row);
    }
    void disturb(const Row& row)
    {
        for (const std::uint32_t i : row.points)
            if (i != IdIndex::none) disturbed_.push_back(i);
    }
    // Points that stay awake in this frame, even if no row is left.
    const std::vector<std::uint32_t>& disturbed() const { return disturbed_; }

    bool is_asleep(const Row& row, const Substep& step) const
    {
        if (!Traits::rests || !row.active || !sleep_) return false;
        bool any = false;
        for (const std::uint32_t i : row.points) {
            if (step.points[i].w > 0) return false;
            any |= sleep_->asleep(i);
        }
        return any;
    }

    // Wakes the sleepers linked to a moving point of infinite mass.
    void wake_by_motion(const Row& row, const Substep& step) const
    {
        const bool moves = std::any_of(row.points.begin(), row.points.end(),
                                       [&](std::uint32_t i) { return !sleep_->asleep(i) && !step.v[i].isZero(0); });
        if (!moves) return;
        for (const std::uint32_t i : row.points) sleep_->wake(i);
    }

    // Wakes the sleepers that a one-sided row begins to load.
    void wake_by_load(const Row& row, const Substep& step) const
    {
        if (!sleep_ || !sleep_->any()) return;
        constexpr double disturbing = 0.1;  // relative to their burden
        for (int k = 0; row.active && !row.asleep && row.impulse > 0 && k < Row::arity; ++k) {
            const std::uint32_t i = row.points[k];
            if (sleep_->asleep(i) && row.impulse > disturbing * step.dt * sleep_->burden(i)) sleep_->wake(i);
        }
    }

    // Keeps the points of a removed row awake in this frame.
    void release(const Row& row) const
    {
        if (sleep_)
            for (const std::uint32_t i : row.points) sleep_->keep_awake(i);
    }

private:
    static bool has_moved(Row& row, const PointSet& points)
    {
        const Strided<Vec3f> places = points.P().read(), v = points.v().read();
        typename Row::Vectors P, gradient;
        for (int k = 0; k < Row::arity; ++k) {
            if (!v[row.points[k]].isZero(0)) return row.resting_residual_exact = false;
            P[k] = places[row.points[k]].template cast<double>();
        }
        const double C = row.function.residual(P, gradient);
        double rounding = 0;
        for (int k = 0; k < Row::arity && !row.resting_residual_exact; ++k)
            rounding += 0x1p-22 * P[k].norm() * gradient[k].norm();
        const double change = std::abs(C - row.resting_residual);
        row.resting_residual = C;
        row.resting_residual_exact = true;
        return change > rounding;
    }

    Sleep* sleep_ = nullptr;
    std::vector<std::uint32_t> disturbed_;
};

}  // namespace rapid

// Rows of one constraint function; XPBD needs only its residual and gradient (row.h). A function looks like this:
//
//   struct Tie {
//       static constexpr int points = 2;
//       double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const;   m, or a unit with a
//                                                                                       compliance to match
//       static constexpr bool one_sided = true;   if C >= 0 satisfies it (pushes only); default false
//       bool breaks(double residual, double pull) const;   optional; called at the end of every substep; pull: the
//                                                          force against the gradient, N
//       double strength;                          optional, of a one-sided function: the largest force, N
//       bool collides;                            optional, of two points: whether contacts act between them;
//                                                 default true
//       static constexpr bool rests = true;       if its points may sleep (sleep.h): the residual depends only on their
//                                                 positions and its own members; default false
//       void discrete_gradient(const std::array<Vec3d, 2>& from, const std::array<Vec3d, 2>& to,
//                              std::array<Vec3d, 2>& gradient) const;   optional (row.h)
//       template <class Archive> void serialize(Archive&);       its members, for snapshots (points/state_archive.h)
//   };
//
// Two-sided rows first apply their forces as part of the points' free motion: rows over two points that form trees are
// solved directly (system_motion.h), all others by conjugate gradients (system_motion.h). They then take part in the
// projection alongside contacts and shapes, by Gauss-Seidel in colours (row_schedule.h). One-sided rows act only in
// the projection.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/base/per_thread.h"
#include "runtime/points/members.h"
#include "runtime/points/point_set.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/row.h"
#include "runtime/solver/constraints/row_schedule.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/solver/constraints/system_motion.h"
#include "runtime/solver/figures.h"
#include "runtime/solver/step_log.h"

namespace rapid {

// Sleep of points that rows hold together: finds sleeping rows and wakes their points.
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
        const Strided<Vec3f> positions = points.P().read(), v = points.v().read();
        typename Row::Vectors P, gradient;
        for (int k = 0; k < Row::arity; ++k) {
            if (!v[row.points[k]].isZero(0)) return row.resting_residual_exact = false;
            P[k] = positions[row.points[k]].template cast<double>();
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

template <class Function>
class Rows : public Coupling {
public:
    using Row = rapid::Row<Function>;
    using Ids = typename Row::Ids;

    // compliance: m/N, 0 for a rigid row.
    void add(const Ids& ids, const Function& function, double compliance)
    {
        rows_.push_back({function, compliance, ids});
        known_is_complete_ = false;
    }

    // Calls f(ids, function) for each row.
    template <class F>
    void for_each(const F& f)
    {
        for (Row& row : rows_) f(std::as_const(row.ids), row.function);
    }

    std::size_t size() const { return rows_.size(); }
    // Returns true if there is a row of these points, in this order. Considers the rows at the last follow().
    bool has(const Ids& ids) const { return std::binary_search(known_.begin(), known_.end(), ids); }

    // Finds the rows' points by id, and removes rows that have lost one. A row acts only if all of its points are in
    // the group.
    void follow(const PointSet& points, const std::string& group)
    {
        const IdIndex index(points.id());
        const Strided<std::uint8_t> members = members_of(points, group);
        sleep_.begin();
        for (Row& row : rows_) {
            row.has_yielded = false;
            changed_ |= row.find_points(index, members);
            const bool acts_otherwise = row.active != row.was_active;
            changed_ |= acts_otherwise;
            row.was_active = row.active;
            sleep_.check(row, acts_otherwise, points);
        }
        remove([](const Row& row) { return row.has_lost_point(); });
        if (std::exchange(known_is_complete_, true)) return;
        known_.clear();
        for (const Row& row : rows_) known_.push_back(row.ids);
        std::sort(known_.begin(), known_.end());
    }

    // Removes the rows whose strength was exceeded in the substep, and calls removed(ids) for each.
    template <class F>
    void break_overloaded(const F& removed)
    {
        break_rows([&](const Row& row) {
            if (!row.is_overloaded) return false;
            removed(row.ids);
            return true;
        });
    }

    // Returns true if there are points to wake in this frame, even if no row is left.
    bool wakes() const { return !sleep_.disturbed().empty(); }
    // Wakes the points of all rows.
    void wake_all()
    {
        for (const Row& row : rows_) sleep_.disturb(row);
    }

    void join(Sleep* sleep) override
    {
        sleep_.join(sleep);
        if (!sleep) return;
        for (const std::uint32_t i : sleep_.disturbed()) sleep->keep_awake(i);
        for (const Row& row : rows_) {
            if (!row.active) continue;
            if (!Traits::rests)
                for (const std::uint32_t i : row.points) sleep->keep_awake(i);
            else if (!Traits::one_sided || row.impulse != 0)
                sleep->link(row.points);
        }
    }

    bool has_forces() const override { return !Traits::one_sided; }

    // The schedule is not stored; it is rebuilt from the rows.
    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(rows_, known_, known_is_complete_, dt_);
        if constexpr (Archive::is_loading::value) {
            StateReader::expect(
                std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.is_possible(); }));
            changed_ = true;
        }
    }

    bool keeps_momentum() const override { return arity > 1; }
    // at: positions; if empty, uses the current ones.
    void add_stored_energy(const Substep& step, std::span<const Vec3d> at, double factor,
                           std::span<double> energy) const override
    {
        typename Row::Vectors P, gradient;
        for (const Row& row : rows_) {
            if (!(row.compliance > 0) || !row.active || row.asleep) continue;
            const auto moves = [&](std::uint32_t i) { return step.points[i].w > 0; };
            auto one = std::find_if(row.points.begin(), row.points.end(), moves);
            if (one == row.points.end()) one = row.points.begin();
            for (int k = 0; k < arity; ++k) P[k] = at.empty() ? step.points[row.points[k]].P : at[row.points[k]];
            double C = row.function.residual(P, gradient);
            if (Traits::one_sided) C = std::min(C, 0.0);
            energy[*one] += factor * 0.5 * C * C / row.compliance;
        }
    }
    void add_joined(std::vector<std::array<std::uint32_t, 2>>& pairs) const override
    {
        if constexpr (requires(Function f) { f.collides; })
            for (const Row& row : rows_)
                if (row.active && !row.function.collides)
                    pairs.push_back({std::min(row.points[0], row.points[1]), std::max(row.points[0], row.points[1])});
    }
    void link(EnergyIslands& islands) const override
    {
        for (const Row& row : rows_)
            if (row.active && !row.asleep) islands.link(row.points);
        for (const typename Row::Points& points : broken_points_) islands.link(points);
    }

    void yield(Substep& step, std::span<const std::uint8_t> points) override
    {
        std::vector<Row*> yielding;
        for (Row& row : rows_) {
            const auto has = [&](std::uint32_t i) { return points[i] != 0; };
            if (!row.active || row.asleep || !std::any_of(row.points.begin(), row.points.end(), has)) continue;
            row.impulse = 0;
            row.has_yielded = true;
            yielding.push_back(&row);
        }
        constexpr int corrections = 10;
        for (int k = 0; k < corrections * step.iterations; ++k)
            for (const Row* row : yielding) row->correct_position(step);
    }

    void move_kinematic(Substep& step) override
    {
        keep_impulses(step.dt);
        broken_points_.clear();
        for (Row& row : rows_) {
            row.asleep = sleep_.is_asleep(row, step);
            if (row.asleep)
                sleep_.wake_by_motion(row, step);
            else if (row.active)
                row.measure(step);
        }
    }

    void advance(Substep& step) override
    {
        if (Traits::one_sided) return;
        exclude_dead(step);
        schedule(step);
        if constexpr (in_trees)
            schedule_.for_each_tree([&](std::span<Forest::Link> tree, std::size_t first) {
                TreeMotion<Function>& motion = motion_of_thread();
                motion.begin(tree, first, rows_);
                motion.advance(step);
            });
        if (!schedule_.others().empty()) system_.advance(rows_, schedule_, step);
    }

    void warm_start(Substep& step) override
    {
        exclude_dead(step);
        // A shock may have woken points in the meantime.
        for (Row& row : rows_) row.asleep = row.asleep && sleep_.is_asleep(row, step);
        schedule(step);
        for (Row& row : rows_) {
            if (!row.active || row.asleep) continue;
            if (Traits::one_sided)
                row.warm_start(step);
            else
                row.keep(step);
        }
    }

    void project(Substep& step) override
    {
        if constexpr (in_trees)
            schedule_.for_each_tree([&](std::span<Forest::Link> tree, std::size_t first) {
                TreeMotion<Function>& motion = motion_of_thread();
                motion.begin(tree, first, rows_);
                motion.project(step);
            });
        schedule_.for_each_coloured([&](std::uint32_t r) { rows_[schedule_.others()[r]].project(step); });
    }

    // Is called for rows that hold points (constraint.h).
    void settle(Substep& step)
    {
        for (Row& row : rows_)
            if (row.active && !row.asleep) row.settle(step);
    }

    void solve_velocities(Substep& step) override
    {
        if (step.is_shared || Traits::one_sided) {
            if constexpr (in_trees)
                schedule_.for_each_tree([&](std::span<Forest::Link> tree, std::size_t first) {
                    TreeMotion<Function>& motion = motion_of_thread();
                    motion.begin(tree, first, rows_);
                    motion.solve_velocities(step);
                });
            for (int k = 0; k < step.iterations; ++k)
                schedule_.for_each_coloured(
                    [&](std::uint32_t r) { rows_[schedule_.others()[r]].solve_velocity(step); });
        }
        if (Traits::one_sided) {
            schedule_.for_each_coloured([&](std::uint32_t r) { rows_[schedule_.others()[r]].correct_position(step); });
            for (const Row& row : rows_) sleep_.wake_by_load(row, step);
        }
        if constexpr (requires { &Function::breaks; })
            break_rows([&](const Row& row) {
                typename Row::Vectors gradient;
                if (!row.function.breaks(row.residual(step, gradient), -row.impulse / step.dt)) return false;
                ++broken_;
                if (step.log)
                    for (const std::uint32_t i : row.points)
                        step.log->add(LoggedBreak{i, step.time, step.points[i].P.template cast<float>(),
                                                  step.v[i].template cast<float>()});
                return true;
            });
    }

    void close(Substep& step, FrameFigures& figures) override
    {
        figures.broken += std::exchange(broken_, 0);
        typename Row::Vectors gradient;
        for (Row& row : rows_) {
            if (!row.active) continue;
            ++figures.constraint_rows;
            const double residual = row.residual(step, gradient);
            if (!row.resting_residual_exact) row.resting_residual = residual;
            const double error = std::abs(row.error(residual, step.dt));
            figures.constraint_residual_max = std::max(figures.constraint_residual_max, error);
            if constexpr (arity > 1)
                figures.loose_constraints +=
                    row.has_yielded ||
                    error > 0.1 * (step.points[row.points[0]].P - step.points[row.points[1]].P).norm();
        }
    }

private:
    using Traits = FunctionTraits<Function>;
    static constexpr int arity = Row::arity;
    static constexpr bool in_trees = arity == 2 && !Traits::one_sided;

    static TreeMotion<Function>& motion_of_thread()
    {
        thread_local PerThread<TreeMotion<Function>> kept;
        return *kept;
    }

    // A substep of another length starts with the same forces.
    void keep_impulses(double dt)
    {
        if (dt_ > 0 && dt_ != dt)
            for (Row& row : rows_) row.impulse *= dt / dt_;
        dt_ = dt;
    }

    void exclude_dead(const Substep& step)
    {
        if (step.dead.empty()) return;
        for (Row& row : rows_)
            for (const std::uint32_t i : row.points)
                changed_ |= row.active && step.dead[i], row.active &= !step.dead[i];
    }

    template <class F>
    void remove(const F& gone)
    {
        if (std::erase_if(rows_, gone) > 0) changed_ = true, known_is_complete_ = false;
    }

    // Removes the acting rows for which breaks(row) is true.
    template <class F>
    void break_rows(const F& breaks)
    {
        remove([&](const Row& row) {
            if (!row.active || row.asleep || !breaks(row)) return false;
            sleep_.release(row);
            broken_points_.push_back(row.points);
            return true;
        });
    }

    // Rebuilds the schedule if rows were added or removed, or points became fixed or free.
    void schedule(const Substep& step)
    {
        std::vector<std::uint8_t> fixed(step.size());
        for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = !(step.points[i].w > 0);
        if (!changed_ && fixed == fixed_) return;
        changed_ = false;
        fixed_ = std::move(fixed);

        std::vector<std::uint32_t> acting, points;
        for (std::uint32_t r = 0; r < rows_.size(); ++r)
            if (rows_[r].active && !rows_[r].asleep)
                acting.push_back(r), points.insert(points.end(), rows_[r].points.begin(), rows_[r].points.end());
        schedule_ = RowSchedule(acting, points, arity, fixed_, in_trees);
    }

    std::vector<Row> rows_;
    std::vector<Ids> known_;          // sorted
    bool known_is_complete_ = false;  // all rows are in known_
    bool changed_ = true;             // after the schedule was built
    // The points of rows that broke in this substep: they have exchanged energy.
    std::vector<typename Row::Points> broken_points_;
    std::uint64_t broken_ = 0;  // rows broken in this frame
    double dt_ = 0;             // s, of the last substep
    std::vector<std::uint8_t> fixed_;
    RowSchedule schedule_;
    SystemMotion<Function> system_;
    RowSleep<Function> sleep_;
};

}  // namespace rapid

// The motion of points that two-sided rows link into nets, over a substep: as in trees (tree_motion.h), but with all
// rows solved at once by conjugate gradients (RowSystem), to a relative 1e-8 or as far as `iterations` allow. The
// discrete gradient points to the positions that the previous substep's forces would give.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/solver/constraints/row.h"
#include "runtime/solver/constraints/row_schedule.h"

namespace rapid {

// The linear system of rows that are in no tree, solved by conjugate gradients:
//
//   Δ = w Σ g λ           per point, over its rows
//   Σ g·Δ + s λ = -e      per row, over its points
//
// Conjugate gradients, with Jacobi's preconditioner, because every iterate is orthogonal to its residual. If s is 0,
// the resulting forces therefore do no work even after few iterations (tree_motion.h), and impulses that stop the
// points along the rows only lose energy.
class RowSystem {
public:
    // Sets up the rows of a substep: `arity` point indices each, out of `size` points. Gradients of inactive rows are
    // 0.
    void begin(std::size_t rows, std::size_t arity, std::size_t size);
    std::size_t size() const { return e.size(); }

    std::vector<std::uint32_t> points;  // [rows, arity]
    std::vector<Vec3d> gradient;        // [rows, arity]
    std::vector<double> e, s;           // [rows]: residual and compliance
    std::vector<double> lambda;         // [rows]: the initial guess, then the solution
    std::vector<double> w;              // [size]: weights

    // Iterates until the residual is `tolerance` times the initial one, or up to the iteration limit. `schedule` has
    // the coloured rows, numbered as here.
    void solve(const RowSchedule& schedule, double tolerance, int max_iterations);

    // Returns w Σ g λ of a point.
    Vec3d shift(std::size_t i) const { return w[i] * sum_[i]; }

private:
    void multiply(const RowSchedule& schedule, std::span<const double> x, std::span<double> y);

    std::size_t arity_ = 0;
    std::vector<Vec3d> sum_;  // [size]: Σ g x
    std::vector<double> residual_, direction_, product_, first_, first_product_, conditioned_, inverse_diagonal_;
};

template <class Function>
class SystemMotion {
public:
    using Row = rapid::Row<Function>;

    // Moves the points of the rows in no tree from the end of their free motion to the solution of the rows.
    void advance(std::span<Row> rows, const RowSchedule& schedule, Substep& step)
    {
        rows_ = rows, schedule_ = &schedule, step_ = &step;
        read();
        solve_forces(to_);
        for (const std::uint32_t i : points_) to_[i] = step.points[i].P + moved_[i];
        solve_forces(to_);
        for (const std::uint32_t i : points_) {
            if (!(inverse_mass_[i] > 0)) continue;
            const Mobility mobility = step.mobility_of(i);
            step.points[i].P += moved_[i];
            if (mobility.x > 0) step.v[i] += mobility.v / mobility.x * moved_[i];
        }
        solve_velocities();
        correct_positions();
        correct_together();
        for (const std::uint32_t i : points_)
            if (step.points[i].w > 0) step.displacement[i] += step.dt * (step.v[i] - free_v_[i]);
    }

private:
    static constexpr int arity = Row::arity;
    static constexpr double accuracy = 1e-8;
    static constexpr int iterations = 20, corrections = 10;  // per iteration of the step
    // A small net is solved for any masses: in exact arithmetic n rows take n iterations.
    static constexpr std::size_t small = 100;
    static constexpr int rounds = 4;
    // Energy that springs with a wrong length may store, relative to the kinetic energy.
    static constexpr double spring_energy_tolerance = 1e-2;
    static constexpr double coarse = 0.1;  // accuracy of a Newton step's linear solve
    static constexpr int newton_steps = 20, halvings = 6;
    // Compliance of a rigid row, relative to its points' inverse mass, so that contradicting rows get a finite load.
    static constexpr double min_compliance = 1e-9;

    template <class F>
    void each_row(const F& f)
    {
        const std::span<const std::uint32_t> others = schedule_->others();
        for_each_chunk(others.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t r = begin; r < end; ++r) f(r, rows_[others[r]]);
        });
    }
    void solve()
    {
        const int all = system_.size() <= small ? rounds * static_cast<int>(system_.size()) : 0;
        system_.solve(*schedule_, accuracy, std::max(all, iterations * step_->iterations));
    }
    // Sets a row's gradient, residual and compliance. An inactive row has a gradient of 0.
    void set(std::size_t r, const typename Row::Vectors& gradient, double e, double s)
    {
        std::copy(gradient.begin(), gradient.end(), system_.gradient.begin() + static_cast<std::ptrdiff_t>(r * arity));
        system_.e[r] = e, system_.s[r] = s;
    }
    void exclude(std::size_t r)
    {
        typename Row::Vectors none;
        none.fill(Vec3d::Zero());
        set(r, none, 0, 1);
    }

    void read()
    {
        Substep& step = *step_;
        const std::span<const std::uint32_t> others = schedule_->others();
        system_.begin(others.size(), arity, step.size());
        points_.clear();
        for (std::size_t r = 0; r < others.size(); ++r)
            for (int k = 0; k < arity; ++k) {
                const std::uint32_t i = rows_[others[r]].points[k];
                system_.points[r * arity + k] = i;
                points_.push_back(i);
            }
        std::sort(points_.begin(), points_.end());
        points_.erase(std::unique(points_.begin(), points_.end()), points_.end());

        for (std::vector<Vec3d>* values : {&from_, &to_, &moved_, &free_v_}) values->resize(step.size());
        inverse_mass_.resize(step.size());
        for (const std::uint32_t i : points_) {
            const ProjectedPoint& at = step.points[i];
            const bool moves = at.w > 0;
            from_[i] = moves ? Vec3d(at.P - step.displacement[i]) : step.start[i];
            to_[i] = at.P;
            free_v_[i] = step.v[i];
            inverse_mass_[i] = moves ? step.inverse_mass[i] : 0;
            system_.w[i] = inverse_mass_[i] * step.mobility_of(i).x;
        }
        for (const std::uint32_t r : others)
            for (int k = 0; k < arity; ++k) {
                const std::uint32_t i = rows_[r].points[k];
                to_[i] += system_.w[i] * (rows_[r].impulse / step.dt) * rows_[r].direction[k];
            }
    }
    void weigh_by_mass()
    {
        for (const std::uint32_t i : points_) system_.w[i] = inverse_mass_[i];
        std::fill(system_.lambda.begin(), system_.lambda.end(), 0.0);
    }
    typename Row::Vectors of(const Row& row, const std::vector<Vec3d>& values) const
    {
        typename Row::Vectors result;
        for (int k = 0; k < arity; ++k) result[k] = values[row.points[k]];
        return result;
    }

    double inverse_mass(const Row& row, const typename Row::Vectors& gradient) const
    {
        double sum = 0;
        for (int k = 0; k < arity; ++k) sum += inverse_mass_[row.points[k]] * gradient[k].squaredNorm();
        return sum;
    }

    // Solves with the discrete gradients towards `to`. moved_ is then the displacement that the forces add to free
    // motion.
    void solve_forces(const std::vector<Vec3d>& to)
    {
        Substep& step = *step_;
        each_row([&](std::size_t r, Row& row) {
            const typename Row::Vectors from = of(row, from_);
            typename Row::Vectors gradient;
            const double C = row.function.residual(from, gradient);
            discrete_gradient(row.function, from, of(row, to), row.direction);
            const double W = inverse_mass(row, row.direction);
            double e = 0;
            for (int k = 0; k < arity; ++k) e += row.direction[k].dot(step.points[row.points[k]].P - from[k]);
            system_.lambda[r] = row.impulse / step.dt;
            row.added = 0;
            if (!(row.compliance > 0))
                set(r, row.direction, e, min_compliance * W * step.mobility_of(row.points[0]).x);
            else if (row.is_stiff(W, step.dt))
                set(r, row.direction, e + C, row.compliance);
            else
                set(r, row.direction, e + C + row.first, 2 * row.compliance);
        });
        solve();
        for (const std::uint32_t i : points_) moved_[i] = system_.shift(i);
        stretch_.resize(system_.size());
        each_row([&](std::size_t r, Row& row) {
            row.impulse = step.dt * system_.lambda[r];
            stretch_[r] = -row.compliance * system_.lambda[r];
        });
    }

    // Removes the velocities along rigid rows.
    void solve_velocities()
    {
        Substep& step = *step_;
        weigh_by_mass();
        each_row([&](std::size_t r, Row& row) {
            typename Row::Vectors gradient;
            row.residual(step, gradient);
            const double W = inverse_mass(row, gradient);
            if (row.is_stiff(W, step.dt))
                set(r, gradient, row.rate(step, gradient), min_compliance * W);
            else
                exclude(r);
        });
        solve();
        for (const std::uint32_t i : points_) step.v[i] += system_.shift(i);
        each_row([&](std::size_t r, Row& row) { row.impulse += system_.lambda[r]; });
    }

    // Moves the points, row by row, until rigid rows have C = 0 and springs too stiff for the substep have the length
    // that fits their force. Skips rows with a point drawn by a spring, because that would take energy from the
    // spring.
    void correct_positions()
    {
        Substep& step = *step_;
        for (int k = 0; k < corrections * step.iterations; ++k)
            schedule_->for_each_coloured([&](std::uint32_t r) {
                const Row& row = rows_[schedule_->others()[r]];
                typename Row::Vectors gradient;
                const double C = off(r, row, gradient), W = inverse_mass(row, gradient);
                if (!(W > 0) || !row.is_stiff(W, step.dt) || is_drawn(row)) return;
                for (int l = 0; l < arity; ++l)
                    shift(row.points[l], -inverse_mass_[row.points[l]] * (C / W) * gradient[l]);
            });
    }
    // Returns the difference of a row's length from the one that fits its force, m.
    double off(std::size_t r, const Row& row, typename Row::Vectors& gradient) const
    {
        return row.residual(*step_, gradient) - stretch_[r];
    }
    void shift(std::uint32_t i, const Vec3d& by)
    {
        step_->points[i].P += by;
        step_->start[i] += by;
    }

    // Springs that still have a wrong length store energy, more so the stiffer they are. Newton steps for all rows at
    // once reduce it, with a line search, because a nearly flat net would be thrown.
    void correct_together()
    {
        const std::span<const std::uint32_t> others = schedule_->others();
        const auto gives = [&](std::uint32_t r) { return rows_[r].compliance > 0; };
        if (std::none_of(others.begin(), others.end(), gives)) return;
        for (int n = 0; n < newton_steps; ++n) {
            const Off before = read_off();
            if (!(before.energy > spring_energy_tolerance * kinetic_energy())) return;
            system_.solve(*schedule_, coarse, iterations);
            double farthest = 0;
            for (const std::uint32_t i : points_) farthest = std::max(farthest, system_.shift(i).norm());
            const double most = 2 * before.sum;
            double part = farthest > most ? most / farthest : 1;
            for (const std::uint32_t i : points_) moved_[i] = system_.shift(i), to_[i] = step_->points[i].P;
            double squares = before.squares;
            for (int k = 0; k < halvings && !(squares < before.squares); ++k, part *= 0.5) {
                for (const std::uint32_t i : points_) step_->points[i].P = to_[i] + part * moved_[i];
                squares = read_off().squares;
            }
            const bool is_nearer = squares < before.squares;
            for (const std::uint32_t i : points_) {
                const Vec3d by = is_nearer ? Vec3d(step_->points[i].P - to_[i]) : Vec3d::Zero();
                step_->points[i].P = to_[i];
                shift(i, by);
            }
            if (!is_nearer) return;
        }
    }
    // Errors of rows that masses can correct: their sum, m, the sum of squares, m², and the energy stored in springs,
    // J.
    struct Off {
        double sum = 0, squares = 0, energy = 0;
    };
    Off read_off()
    {
        weigh_by_mass();
        each_row([&](std::size_t r, Row& row) {
            typename Row::Vectors gradient;
            const double C = off(r, row, gradient), W = inverse_mass(row, gradient);
            if (W > 0 && row.is_stiff(W, step_->dt) && !is_drawn(row))
                set(r, gradient, C, min_compliance * W);
            else
                exclude(r);
        });
        Off all;
        for (std::size_t r = 0; r < system_.size(); ++r) {
            const double C = system_.e[r], compliance = rows_[schedule_->others()[r]].compliance;
            all.sum += std::abs(C), all.squares += C * C;
            if (compliance > 0) all.energy += 0.5 * C * C / compliance;
        }
        return all;
    }
    double kinetic_energy() const
    {
        double sum = 0;
        for (const std::uint32_t i : points_)
            if (inverse_mass_[i] > 0) sum += 0.5 * step_->v[i].squaredNorm() / inverse_mass_[i];
        return sum;
    }
    bool is_drawn(const Row& row) const
    {
        return std::any_of(row.points.begin(), row.points.end(),
                           [&](std::uint32_t i) { return step_->mobility_of(i).stiffness > 0; });
    }

    std::span<Row> rows_;
    const RowSchedule* schedule_ = nullptr;
    Substep* step_ = nullptr;
    RowSystem system_;
    std::vector<std::uint32_t> points_;              // of the rows, ascending
    std::vector<Vec3d> from_, to_, moved_, free_v_;  // by point: beginning, estimate of the end, m; m/s
    std::vector<double> inverse_mass_;               // by point, 1/kg
    std::vector<double> stretch_;                    // by row, m: stretch that fits its force
};

}  // namespace rapid

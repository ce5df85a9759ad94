// The motion of points that two-sided rows link into nets, over a substep: as in trees, but with all
// rows solved at once by conjugate gradients (RowSystem), to a relative 1e-8 or as far as `iterations` allow. The
// discrete gradient points to the positions that the previous substep's forces would give.
#pragma once

#include <algorithm>
#include <cmath>
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
// the resulting forces therefore do no work even after few iterations, and impulses that stop the
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

// The motion of points that two-sided rows link into trees, over a substep.
//
// The force F of a row is constant throughout a step of length h. It acts along the discrete gradient D between the
// points' positions at its beginning and its end (row.h). With s the displacement of the free motion, and X and V the
// changes in position and velocity due to a constant acceleration of 1 (h²/2 and h in free flight),
//
//   Δx = s + w X Σ D F,   Δv = w V Σ D F
//   rigid       D·Δx = 0
//   compliant   α F + C + θ D·Δx = 0        θ = 1/2; 1 if α < Σ w |D|² h², which no step resolves
//
// (the energy-momentum method; Gonzalez 1996, 1999). A rigid row does no work for any h, F and masses; a compliant one
// gives its points at most the energy that its C²/2α loses. Velocities along rigid rows are then removed, which only
// loses energy, and their remaining residual is corrected without adding speed. A tree therefore gains no energy.
//
// Order 2. If D does not converge, or removing velocities loses too much energy, the tree takes steps of half the
// length: a light point between heavy ones turns much faster than they do.

// Direct solution of a tree of links.
//
// One sweep of Gauss-Seidel propagates a correction by one link, so a chain of 1,000 links would need 1,000 sweeps.
// The linear system of a tree is solved in one pass from the leaves to the root and one back, in linear time (Baraff
// 1996). The mobility that a point has left after its subtree is joined to it is a 3 by 3 matrix. A link joins it by a
// rank-one update: no matrix is inverted, and rigid links to fixed points need no special case.

// Solves one tree for the multipliers λ of its links and the shifts of its points:
//
//   Δ = w Σ g λ           per point, over its links
//   Σ g·Δ + s λ = -e      per link, over its two ends
//
// Each link provides gradients g, e and s >= 0 (infinite: the link does not act). w(k) provides the weights: of the
// root for k = 0, else of the child of link k - 1. A point with weight 0 does not move. Returns the root's shift, and
// sets link.lambda and link.shift. `first` is the index of the tree's first link.
template <class Weight>
Vec3d solve_tree(std::span<Forest::Link> tree, std::size_t first, const Weight& w)
{
    // Compliance of a link that the joined part leaves no freedom, relative to the freedom of its ends alone, so that
    // pins that no tree can reach get a finite load.
    constexpr double min_compliance = 1e-9;

    // From the leaves: `mobility` is the shift of a point per impulse, `shift` that due to its subtree.
    Eigen::Matrix3d root_mobility = w(0) * Eigen::Matrix3d::Identity();
    Vec3d root_shift = Vec3d::Zero();
    for (std::size_t k = 0; k < tree.size(); ++k) {
        tree[k].mobility = w(k + 1) * Eigen::Matrix3d::Identity();
        tree[k].shift.setZero();
    }
    for (std::size_t k = tree.size(); k-- > 0;) {
        Forest::Link& link = tree[k];
        const std::size_t above = link.above - first;
        const double w_above = above == k ? w(0) : w(above + 1);
        Eigen::Matrix3d& mobility = above == k ? root_mobility : tree[above].mobility;
        Vec3d& shift = above == k ? root_shift : tree[above].shift;
        link.reach = mobility * link.gradient_above;
        link.e += link.gradient.dot(link.shift) + link.gradient_above.dot(shift);
        const double least =
            min_compliance * (w(k + 1) * link.gradient.squaredNorm() + w_above * link.gradient_above.squaredNorm());
        link.s = std::max(
            link.s + link.gradient.dot(link.mobility * link.gradient) + link.gradient_above.dot(link.reach), least);
        if (!(link.s > 0)) continue;
        mobility -= link.reach * (link.reach / link.s).transpose();
        shift -= link.e / link.s * link.reach;
    }

    // Back to the leaves: `shift` accumulates the impulses of its links on a point.
    root_shift.setZero();
    for (std::size_t k = 0; k < tree.size(); ++k) {
        Forest::Link& link = tree[k];
        const std::size_t above = link.above - first;
        Vec3d& impulse = above == k ? root_shift : tree[above].shift;
        link.lambda = link.s > 0 ? -(link.e + link.reach.dot(impulse)) / link.s : 0;
        impulse += link.lambda * link.gradient_above;
        link.shift = link.lambda * link.gradient;
    }
    for (std::size_t k = 0; k < tree.size(); ++k) tree[k].shift *= w(k + 1);
    return w(0) * root_shift;
}

template <class Function>
class TreeMotion {
public:
    using Row = rapid::Row<Function>;

    // Selects one tree of rows; first: the index of its first link. Must be called before the functions below.
    void begin(std::span<Forest::Link> tree, std::size_t first, std::span<Row> rows)
    {
        tree_ = tree, first_ = first, rows_ = rows;
    }

    // Moves the points from the end of their free motion to the solution of the rows.
    void advance(Substep& step)
    {
        read(step);
        if (is_ballistic_) project_velocities(from_);  // impacts may have left some along the rows
        const std::int64_t whole = is_ballistic_ ? std::int64_t{1} << max_halvings : 1;
        std::int64_t done = 0;
        for (std::int64_t length = whole; done < whole;) {
            const double part = static_cast<double>(length) / static_cast<double>(whole);
            h_ = part * step.dt;
            take_step();
            const bool is_accurate = converged_ && (!is_rigid_ || lost_ <= largest_loss * part * kinetic_);
            if (length > 1 && !is_accurate) {
                length /= 2;
                continue;
            }
            accept();
            done += length;
            while (length < whole && done % (2 * length) == 0) length *= 2;
        }
        write(step);
    }

    // Restores C to the rows' reference after others have pushed the points.
    void project(Substep& step)
    {
        double residuals = 0;
        for (Forest::Link& link : tree_) {
            const Row& row = rows_[link.row];
            typename Row::Vectors gradient;
            link.e = row.residual(step, gradient) - row.reference + row.softness * step.dt * row.added;
            link.s = row.softness;
            orient(link, gradient);
            residuals += std::abs(link.e);
        }
        const Vec3d root = solve(step);
        const double part = reasonable_part(residuals, root);
        step.points[tree_.front().parent].P += part * root;
        for (const Forest::Link& link : tree_) {
            Row& row = rows_[link.row];
            const double change = part * link.lambda / step.dt;
            row.take(change);
            step.points[link.child].P += part * link.shift;
            if (!row.is_resolved) continue;
            step.v[link.child] += step.points[link.child].w * change * link.gradient;
            step.v[link.parent] += step.points[link.parent].w * change * link.gradient_above;
        }
    }

    // Removes the remaining velocities along rigid rows.
    void solve_velocities(Substep& step)
    {
        for (Forest::Link& link : tree_) {
            const Row& row = rows_[link.row];
            typename Row::Vectors gradient;
            row.residual(step, gradient);
            link.e = row.rate(step, gradient);
            link.s = row.is_stiff(row.inverse_mass(step, gradient), step.dt) ? 0 : absent;
            orient(link, gradient);
        }
        const Vec3d root = solve(step);
        step.v[tree_.front().parent] += root;
        for (const Forest::Link& link : tree_) {
            rows_[link.row].impulse += link.lambda;
            step.v[link.child] += link.shift;
        }
    }

private:
    static constexpr double absent = std::numeric_limits<double>::infinity();  // compliance of an inactive row

    // Limits on halving a substep. A step is halved if it has not found D to `largest_error`, relative to a row's
    // length, within `max_solutions`, or if its velocities lose more than `largest_loss` of the substep's energy.
    static constexpr int max_halvings = 8, max_solutions = 4, max_corrections = 3;
    static constexpr double largest_error = 1e-6, largest_loss = 1e-5;

    struct Point {
        Vec3d P, v, a;    // at the beginning of a step; a: of the free motion, m/s²
        double w;         // 1/kg
        Vec3d corrected;  // m, so far in this substep
    };

    // Points are numbered by link: the root is 0, the child of link k is k + 1.
    std::size_t parent(std::size_t k) const
    {
        const std::size_t above = tree_[k].above - first_;
        return above == k ? 0 : above + 1;
    }
    typename Row::Vectors of(std::size_t k, const std::vector<Point>& points, Vec3d Point::*member) const
    {
        const Vec3d &child = points[k + 1].*member, &above = points[parent(k)].*member;
        return tree_[k].flipped ? typename Row::Vectors{child, above} : typename Row::Vectors{above, child};
    }
    static void orient(Forest::Link& link, const typename Row::Vectors& gradient)
    {
        link.gradient = gradient[link.flipped ? 0 : 1];
        link.gradient_above = gradient[link.flipped ? 1 : 0];
    }
    static double dot(const typename Row::Vectors& a, const typename Row::Vectors& b)
    {
        return a[0].dot(b[0]) + a[1].dot(b[1]);
    }
    double inverse_mass(std::size_t k) const
    {
        const Forest::Link& link = tree_[k];
        return from_[k + 1].w * link.gradient.squaredNorm() + from_[parent(k)].w * link.gradient_above.squaredNorm();
    }
    Vec3d solve(const Substep& step)
    {
        return solve_tree(tree_, first_,
                          [&](std::size_t k) { return step.points[k ? tree_[k - 1].child : tree_.front().parent].w; });
    }

    void read(const Substep& step)
    {
        const std::size_t n = tree_.size() + 1;
        from_.resize(n), to_.resize(n), x_.resize(n), u_.resize(n), pull_.resize(n), stiffness_.resize(n);
        forces_.resize(n - 1);
        is_ballistic_ = true;
        h_ = step.dt;
        for (std::size_t k = 0; k < n; ++k) {
            const std::uint32_t i = k ? tree_[k - 1].child : tree_.front().parent;
            const ProjectedPoint& at = step.points[i];
            const Mobility mobility = step.mobility_of(i);
            const bool moves = at.w > 0;
            const Vec3d s = moves ? step.displacement[i] : Vec3d(at.P - step.start[i]);
            // The parabola that ends there with this velocity.
            from_[k] = {at.P - s, 2 / h_ * s - step.v[i], 2 / h_ * (step.v[i] - s / h_),
                        moves ? step.inverse_mass[i] : 0, Vec3d::Zero()};
            x_[k] = mobility.x, u_[k] = mobility.v;
            pull_[k] = mobility.pull, stiffness_[k] = mobility.stiffness;
            is_ballistic_ &= !moves || (mobility.v == h_ && mobility.x == 0.5 * h_ * h_);
        }
        is_rigid_ = true;
        for (const Forest::Link& link : tree_) {
            Row& row = rows_[link.row];
            row.impulse = row.added = 0;
            is_rigid_ &= !(row.compliance > 0);
        }
    }

    // Computes to_ from from_.
    void take_step()
    {
        if (is_ballistic_) {
            std::fill(x_.begin(), x_.end(), 0.5 * h_ * h_);
            std::fill(u_.begin(), u_.end(), h_);
        }
        for (std::size_t k = 0; k < to_.size(); ++k) {
            to_[k] = from_[k];
            to_[k].P += h_ * (from_[k].v + 0.5 * h_ * from_[k].a);
        }
        converged_ = false;
        for (int n = 0; n < max_solutions && !converged_; ++n) solve_motion();
        kinetic_ = 0;
        for (std::size_t k = 0; k < to_.size(); ++k) {
            const Vec3d& shift = k ? tree_[k - 1].shift : root_shift_;
            to_[k].v += h_ * from_[k].a;
            if (!(from_[k].w > 0)) continue;
            if (x_[k] > 0) to_[k].v += u_[k] / x_[k] * shift;
            kinetic_ += 0.5 * (to_[k].v.squaredNorm() + (h_ * from_[k].a).squaredNorm()) / from_[k].w;
        }
        for (std::size_t k = 0; k < tree_.size(); ++k) forces_[k] = tree_[k].lambda;
        lost_ = project_velocities(to_);
        correct_positions();
    }

    // Solves once for the forces, along the discrete gradients towards to_.
    void solve_motion()
    {
        for (std::size_t k = 0; k < tree_.size(); ++k) {
            Forest::Link& link = tree_[k];
            const Row& row = rows_[link.row];
            const typename Row::Vectors P = of(k, from_, &Point::P), v = of(k, from_, &Point::v),
                                        a = of(k, from_, &Point::a);
            typename Row::Vectors D;
            discrete_gradient(row.function, P, of(k, to_, &Point::P), D);
            orient(link, D);
            link.e = h_ * (dot(D, v) + 0.5 * h_ * dot(D, a));
            link.s = 0;
            if (!(row.compliance > 0)) continue;
            typename Row::Vectors gradient;
            const double theta = row.is_stiff(inverse_mass(k), h_) ? 1 : 0.5;
            link.e += row.function.residual(P, gradient) / theta;
            link.s = row.compliance / theta;
        }
        root_shift_ = solve_tree(tree_, first_, [&](std::size_t k) { return from_[k].w * x_[k]; });
        for (std::size_t k = 0; k < to_.size(); ++k)
            to_[k].P = from_[k].P + h_ * (from_[k].v + 0.5 * h_ * from_[k].a) + (k ? tree_[k - 1].shift : root_shift_);
        converged_ = true;
        for (std::size_t k = 0; k < tree_.size() && converged_; ++k) {
            const Function& function = rows_[tree_[k].row].function;
            const typename Row::Vectors P = of(k, from_, &Point::P), Q = of(k, to_, &Point::P);
            typename Row::Vectors D, gradient;
            discrete_gradient(function, P, Q, D);
            const typename Row::Vectors used = tree_[k].flipped
                                                   ? typename Row::Vectors{tree_[k].gradient, tree_[k].gradient_above}
                                                   : typename Row::Vectors{tree_[k].gradient_above, tree_[k].gradient};
            const typename Row::Vectors moved{Q[0] - P[0], Q[1] - P[1]};
            converged_ = std::abs(dot(D, moved) - dot(used, moved)) <= largest_error * (P[0] - P[1]).norm();
        }
    }

    // Removes the velocities along rigid rows. Returns the energy lost, J.
    double project_velocities(std::vector<Point>& points)
    {
        for (std::size_t k = 0; k < tree_.size(); ++k) {
            Forest::Link& link = tree_[k];
            typename Row::Vectors gradient;
            rows_[link.row].function.residual(of(k, points, &Point::P), gradient);
            orient(link, gradient);
            link.e = dot(gradient, of(k, points, &Point::v));
            link.s = rows_[link.row].is_stiff(inverse_mass(k), h_) ? 0 : absent;
        }
        const Vec3d root = solve_tree(tree_, first_, [&](std::size_t k) { return from_[k].w; });
        double lost = 0;
        for (std::size_t k = 0; k < points.size(); ++k) {
            if (!(from_[k].w > 0)) continue;
            const Vec3d& change = k ? tree_[k - 1].shift : root;
            points[k].v += change;
            lost += 0.5 * change.squaredNorm() / from_[k].w;
        }
        return lost;
    }

    // Takes Newton steps until the rigid rows have C = 0.
    void correct_positions()
    {
        for (int n = 0; n < max_corrections; ++n) {
            double residuals = 0, longest = 0;
            for (std::size_t k = 0; k < tree_.size(); ++k) {
                Forest::Link& link = tree_[k];
                const Row& row = rows_[link.row];
                typename Row::Vectors gradient;
                const typename Row::Vectors P = of(k, to_, &Point::P);
                link.e = row.function.residual(P, gradient);
                link.s = row.compliance > 0 ? absent : 0;
                orient(link, gradient);
                if (row.compliance > 0) continue;
                residuals += std::abs(link.e);
                longest = std::max(longest, (P[0] - P[1]).norm());
            }
            if (!(residuals > 0x1p-50 * longest)) return;
            const Vec3d root = solve_tree(tree_, first_, [&](std::size_t k) { return from_[k].w; });
            double part = reasonable_part(residuals, root);
            if (!is_ballistic_) part = std::min(part, largest_free_part(root));
            for (std::size_t k = 0; k < to_.size(); ++k) {
                const Vec3d correction = part * (k ? tree_[k - 1].shift : root);
                to_[k].P += correction;
                to_[k].corrected += correction;
            }
        }
    }

    // Returns the fraction of a Newton step for which no point moves much farther than the sum of the residuals. Pins
    // that no tree can connect, and nearly folded links, would otherwise throw points around.
    double reasonable_part(double residuals, const Vec3d& root) const
    {
        double farthest = root.norm();
        for (const Forest::Link& link : tree_) farthest = std::max(farthest, link.shift.norm());
        return farthest > 2 * residuals ? 2 * residuals / farthest : 1;
    }

    // Returns the largest fraction of a correction that takes no energy from the springs of the points' free motion.
    double largest_free_part(const Vec3d& root) const
    {
        double slope = 0, curvature = 0;
        for (std::size_t k = 0; k < to_.size(); ++k) {
            if (!(stiffness_[k] > 0) || !(from_[k].w > 0)) continue;
            const Vec3d& shift = k ? tree_[k - 1].shift : root;
            slope += shift.dot(stiffness_[k] * to_[k].P - pull_[k]) / from_[k].w;
            curvature += stiffness_[k] * shift.squaredNorm() / from_[k].w;
        }
        return curvature > 0 ? std::clamp(-2 * slope / curvature, 0.0, 1.0) : 1.0;
    }

    void accept()
    {
        std::swap(from_, to_);
        for (std::size_t k = 0; k < tree_.size(); ++k) rows_[tree_[k].row].impulse += h_ * forces_[k];
    }

    void write(Substep& step)
    {
        for (std::size_t k = 0; k < from_.size(); ++k) {
            const std::uint32_t i = k ? tree_[k - 1].child : tree_.front().parent;
            if (!(from_[k].w > 0)) continue;
            step.displacement[i] += step.dt * (from_[k].v - step.v[i]);
            step.points[i].P = from_[k].P;
            step.start[i] += from_[k].corrected;
            step.v[i] = from_[k].v;
        }
    }

    std::span<Forest::Link> tree_;
    std::size_t first_ = 0;
    std::span<Row> rows_;
    std::vector<Point> from_, to_;
    std::vector<double> x_, u_;   // changes in position and velocity due to 1 m/s² in a step, s² and s
    std::vector<double> forces_;  // N, of the links
    std::vector<Vec3d> pull_;     // Mobility::pull
    std::vector<double> stiffness_;
    Vec3d root_shift_;
    double h_ = 0;                   // s, length of the step
    double kinetic_ = 0, lost_ = 0;  // J, at the end of the step
    bool is_ballistic_ = true, is_rigid_ = true, converged_ = false;
};

}  // namespace rapid

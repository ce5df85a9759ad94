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
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "runtime/solver/constraints/forest.h"
#include "runtime/solver/constraints/row.h"

namespace rapid {

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

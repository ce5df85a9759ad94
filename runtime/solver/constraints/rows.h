// Rows of one kind, which are solved from their residual and its gradient alone (XPBD; Macklin et al. 2016):
//
//   Δλ = (-C - α~ λ) / (Σ w |∇C|² + α~),   Δx = w ∇C Δλ,   α~ = α / dt²
//
// The multiplier λ is accumulated over the iterations of a sub-step: reset in each, it would make every spring rigid.
// One-sided rows begin with that of the sub-step before, as contacts do (contacts.h): what presses and what pulls in a
// heap is then in balance before it is iterated.
// A kind is
//
//   struct Tie {
//       static constexpr int points = 2;
//       double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const;   m, or what has a
//                                                                                       compliance to go with it
//       static constexpr bool one_sided = true;   where C >= 0 satisfies it (pushes only); false if not said
//       bool breaks(double residual) const;       where it can: asked at the end of every sub-step
//       static constexpr bool rests = true;       where its points may sleep (sleep.h): what it does depends on nothing
//                                                 but their places and its own members; false if not said
//       Eigen::Matrix3d curvature(const std::array<Vec3d, 2>& P) const;   where it has one: the second derivative of
//                                                             the residual by P[0] - P[1]; keeps taut ropes stable
//   };
//
// Rows over two points that make trees are solved directly (forest.h); all others by Gauss-Seidel in colours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include "runtime/parallel.h"
#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/forest.h"
#include "runtime/solver/constraints/graph_colouring.h"

namespace rapid {

// Where the points of a set are, by id.
class PlacesById {
public:
    static constexpr std::uint32_t none = UINT32_MAX;

    explicit PlacesById(const Column<std::int64_t>& ids);
    std::uint32_t operator[](std::int64_t id) const;

private:
    Strided<std::int64_t> ids_;
    std::size_t size_;
    std::vector<std::pair<std::int64_t, std::uint32_t>> sorted_;  // empty where the ids ascend already
};

template <class Kind>
class Rows : public Coupling {
public:
    static constexpr int arity = Kind::points;
    using Ids = std::array<std::int64_t, arity>;
    using Places = std::array<std::uint32_t, arity>;

    // compliance: m/N, 0 for a rigid row.
    void add(const Ids& ids, const Kind& kind, double compliance)
    {
        rows_.push_back({kind, compliance, ids});
        listed_ = false;
    }

    std::size_t size() const { return rows_.size(); }
    // Whether there is a row of these points, in this order. Of rows that follow() has seen.
    bool has(const Ids& ids) const { return std::binary_search(known_.begin(), known_.end(), ids); }

    // Finds the rows' points, which are followed by id; rows that have lost one are gone. A row acts while all of its
    // points are in the group.
    void follow(const PointSet& points, const std::string& group)
    {
        const PlacesById place(points.id());
        const Strided<std::uint8_t> members = members_of(points, group);
        roused_.clear();
        for (Row& row : rows_) {
            row.acts = true;
            for (int k = 0; k < arity; ++k) {
                const std::uint32_t i = place[row.ids[k]];
                changed_ |= i != row.at[k];
                row.at[k] = i;
                row.acts &= i != PlacesById::none && members[i];
            }
            const bool other = row.acts != row.acted;
            changed_ |= other;
            row.acted = row.acts;
            if (rests && (other || (row.acts && differs(row, points)))) note(row);
        }
        drop([](const Row& row) { return std::find(row.at.begin(), row.at.end(), PlacesById::none) != row.at.end(); });
        if (std::exchange(listed_, true)) return;
        known_.clear();
        for (const Row& row : rows_) known_.push_back(row.ids);
        std::sort(known_.begin(), known_.end());
    }

    // Takes away the rows that have acted with more than `force` (N) in the sub-step, and tells whose.
    template <class F>
    void break_above(double force, const Substep& now, const F& tell)
    {
        const double most = force * now.dt * now.dt;
        drop([&](const Row& row) {
            if (!row.acts || row.sleeps || !(std::abs(row.lambda) > most)) return false;
            tell(row.ids);
            let_go(row, now);
            return true;
        });
    }

    // Whether points are not what they were, as follow() has found: they are to be told of, even by no row.
    bool rouses() const { return !roused_.empty(); }
    // Those of all rows are to be looked at anew in this frame.
    void rouse_all()
    {
        for (const Row& row : rows_) note(row);
    }

    void tie(std::span<std::uint8_t> tied) const override
    {
        for (const std::uint32_t i : roused_) tied[i] = 1;
        if (rests) return;
        for (const Row& row : rows_)
            for (int k = 0; row.acts && k < arity; ++k) tied[row.at[k]] = 1;
    }

    void bind(Islands& islands) const override
    {
        for (const Row& row : rows_)
            if (rests && row.acts && !(one_sided && row.lambda == 0)) islands.bind(row.at);
    }

    void resume(Substep& now) override
    {
        keep_forces(now.dt);
        for (Row& row : rows_) {
            row.sleeps = sleeps(row, now);
            if (row.sleeps)
                wake_by_moving(row, now);
            else
                resume(row, now);
        }
    }

    void prepare(Substep& now) override
    {
        if (!now.dead.empty()) {
            for (Row& row : rows_)
                for (const std::uint32_t i : row.at) changed_ |= row.acts && now.dead[i], row.acts &= !now.dead[i];
        }
        // What a shock has woken since.
        for (Row& row : rows_)
            if (row.sleeps && !sleeps(row, now)) row.sleeps = false, resume(row, now);
        schedule(now);
        std::array<Vec3d, arity> P;
        for (Row& row : rows_) {
            if (!row.acts || row.sleeps) continue;
            for (int k = 0; k < arity; ++k) P[k] = now.begin[row.at[k]];
            row.kind.residual(P, row.along);
            row.before = row.lambda;
            if (one_sided)
                for (int k = 0; k < arity; ++k) now.at[row.at[k]].P += now.at[row.at[k]].w * row.lambda * row.along[k];
            else
                row.lambda = 0;
        }
    }

    void project(Substep& now) override
    {
        const double per_dt2 = 1 / (now.dt * now.dt);
        if constexpr (direct)
            for_each_tree([&](std::size_t begin, std::size_t end) { solve_directly(now, begin, end, per_dt2); });
        const std::span<const std::uint32_t> order = colours_.order;
        for (std::size_t c = 0; c + 1 < colours_.begin.size(); ++c)
            for_each_chunk(colours_.begin[c + 1] - colours_.begin[c], [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = begin; k < end; ++k) solve(rows_[order[colours_.begin[c] + k]], now, per_dt2);
            });
        for (const std::uint32_t r : order.last(colours_.in_turn)) solve(rows_[r], now, per_dt2);
    }

    void suspend(Substep& now) override
    {
        const double per_dt2 = 1 / (now.dt * now.dt);
        for (Row& row : rows_)
            for (int k = 0; row.acts && !row.sleeps && k < arity; ++k) {
                const std::uint32_t i = row.at[k];
                const Yield by = now.yield_of(i);
                row.pull[k] = now.at[i].w * (now.dt / by.v) * row.lambda * per_dt2 * row.along[k];
                now.v[i] += 0.5 * by.v * row.pull[k];
            }
    }

    void settle(Substep& now) override
    {
        if (one_sided && now.sleepers && now.sleepers->any()) disturb(now);
        if constexpr (requires(const Kind& kind) { kind.breaks(0.0); })
            drop([&](const Row& row) {
                std::array<Vec3d, arity> gradient;
                const bool breaks = row.acts && !row.sleeps && row.kind.breaks(evaluate(row, now, gradient));
                if (breaks) let_go(row, now);
                return breaks;
            });
    }

    Residual close(Substep& now) override
    {
        keep_forces(now.dt);
        Residual result;
        const double per_dt2 = 1 / (now.dt * now.dt);
        std::array<Vec3d, arity> gradient;
        for (Row& row : rows_) {
            if (!row.acts) continue;
            ++result.rows;
            const double residual = evaluate(row, now, gradient);
            if (!row.exact) row.left = residual;
            double C = residual + row.compliance * per_dt2 * row.lambda;
            if (one_sided) C = std::min(C, 0.0);
            result.worst = std::max(result.worst, std::abs(C));
            if constexpr (arity > 1)
                result.loose += std::abs(C) > 0.1 * (now.at[row.at[0]].P - now.at[row.at[1]].P).norm();
        }
        return result;
    }

private:
    static constexpr bool one_sided = [] {
        if constexpr (requires { Kind::one_sided; }) return Kind::one_sided;
        return false;
    }();

    static constexpr bool rests = [] {
        if constexpr (requires { Kind::rests; }) return Kind::rests;
        return false;
    }();

    static constexpr bool direct = arity == 2 && !one_sided;
    static constexpr bool has_curvature = requires(const Kind& kind, const std::array<Vec3d, arity>& P)
    {
        kind.curvature(P);
    };

    struct Row {
        Kind kind;
        double compliance;
        Ids ids;
        Places at = filled(PlacesById::none);
        double lambda = 0, before = 0;            // N s², of this sub-step and of that before
        std::array<Vec3d, arity> along = zero();  // the gradient that it acts along
        std::array<Vec3d, arity> pull = zero();   // m/s², of each point at the end of a sub-step
        bool acts = true, acted = false;
        bool sleeps = false;  // in this sub-step: none of its points moves, as one of them sleeps
        // The residual as the last frame left it; to the bit where it began with all points without velocity.
        double left = std::numeric_limits<double>::quiet_NaN();
        bool exact = false;

        static std::array<Vec3d, arity> zero()
        {
            std::array<Vec3d, arity> result;
            result.fill(Vec3d::Zero());
            return result;
        }
        static Places filled(std::uint32_t value)
        {
            Places places;
            places.fill(value);
            return places;
        }
    };

    void note(const Row& row)
    {
        for (const std::uint32_t i : row.at)
            if (i != PlacesById::none) roused_.push_back(i);
    }

    // Whether what holds points that may be asleep is not what it was: one that no row moves has moved.
    static bool differs(Row& row, const PointSet& points)
    {
        const Strided<Vec3f> places = points.P().read(), v = points.v().read();
        std::array<Vec3d, arity> P, gradient;
        for (int k = 0; k < arity; ++k) {
            if (!v[row.at[k]].isZero(0)) return row.exact = false;
            P[k] = places[row.at[k]].template cast<double>();
        }
        const double C = row.kind.residual(P, gradient);
        double rounding = 0;
        for (int k = 0; k < arity && !row.exact; ++k) rounding += 0x1p-22 * P[k].norm() * gradient[k].norm();
        const double change = std::abs(C - row.left);
        row.left = C;
        row.exact = true;
        return change > rounding;
    }

    static bool sleeps(const Row& row, const Substep& now)
    {
        if (!rests || !row.acts || !now.sleepers) return false;
        bool any = false;
        for (const std::uint32_t i : row.at) {
            if (now.at[i].w > 0) return false;
            any |= now.asleep(i);
        }
        return any;
    }

    // What no row moves, and goes its way, wakes the sleepers that are tied to it.
    static void wake_by_moving(const Row& row, const Substep& now)
    {
        const bool moves = std::any_of(row.at.begin(), row.at.end(),
                                       [&](std::uint32_t i) { return !now.asleep(i) && !now.v[i].isZero(0); });
        if (!moves) return;
        for (const std::uint32_t i : row.at) now.sleepers->wake(i);
    }

    // Wakes sleepers that a row begins to act on which did not when they fell asleep.
    void disturb(const Substep& now) const
    {
        constexpr double disturbed = 0.1;  // of what they bear
        for (const Row& row : rows_)
            for (int k = 0; row.acts && !row.sleeps && row.lambda > 0 && k < arity; ++k) {
                const std::uint32_t i = row.at[k];
                if (now.asleep(i) && row.lambda > disturbed * now.dt * now.dt * now.sleepers->burden(i))
                    now.sleepers->wake(i);
            }
    }

    // The points of a row that is gone do not fall asleep in this frame.
    static void let_go(const Row& row, const Substep& now)
    {
        if (now.sleepers)
            for (const std::uint32_t i : row.at) now.sleepers->keep_awake(i);
    }

    static void resume(const Row& row, Substep& now)
    {
        for (int k = 0; row.acts && k < arity; ++k) {
            const std::uint32_t i = row.at[k];
            if (!(now.at[i].w > 0)) continue;
            const Yield by = now.yield_of(i);
            now.at[i].P -= (by.v * now.dt - by.x) * row.pull[k];
            now.v[i] -= 0.5 * by.v * row.pull[k];
        }
    }

    static double evaluate(const Row& row, const Substep& now, std::array<Vec3d, arity>& gradient)
    {
        std::array<Vec3d, arity> P;
        for (int k = 0; k < arity; ++k) P[k] = now.at[row.at[k]].P;
        return row.kind.residual(P, gradient);
    }

    // Acts along the gradient at the sub-step's beginning, which keeps angular momentum and is of second order (as
    // SHAKE does); but where the points have turned too far by now for that, or are held so tightly that they would
    // swing across it, along the gradient here, which is of first order and always stable.
    static void choose_direction(Row& row, const Substep& now, const std::array<Vec3d, arity>& P,
                                 const std::array<Vec3d, arity>& gradient)
    {
        double same = 0, size = 0, weight = 0;
        for (int k = 0; k < arity; ++k) {
            same += gradient[k].dot(row.along[k]);
            size += gradient[k].squaredNorm();
            weight += now.at[row.at[k]].w;
        }
        bool here = same < 0.8 * size;
        if constexpr (has_curvature)
            here |= std::abs(row.before) * weight * row.kind.curvature(P).diagonal().maxCoeff() > 0.5;
        else
            static_cast<void>(P), static_cast<void>(weight);
        if (here) row.along = gradient;
    }

    static void solve(Row& row, Substep& now, double per_dt2)
    {
        std::array<Vec3d, arity> P, gradient;
        for (int k = 0; k < arity; ++k) P[k] = now.at[row.at[k]].P;
        const double C = row.kind.residual(P, gradient), softness = row.compliance * per_dt2;
        choose_direction(row, now, P, gradient);
        double stiffness = softness;
        for (int k = 0; k < arity; ++k) stiffness += now.at[row.at[k]].w * gradient[k].dot(row.along[k]);
        if (!(stiffness > 0)) return;
        double change = (-C - softness * row.lambda) / stiffness;
        if (one_sided) change = std::max(change, -row.lambda);
        row.lambda += change;
        for (int k = 0; k < arity; ++k) {
            Place& place = now.at[row.at[k]];
            place.P += place.w * change * row.along[k];
        }
    }

    void solve_directly(Substep& now, std::size_t begin, std::size_t end, double per_dt2)
    {
        const std::span<Forest::Link> tree = std::span(forest_.links).subspan(begin, end - begin);
        std::array<Vec3d, arity> P, gradient;
        for (Forest::Link& link : tree) {
            Row& row = rows_[link.row];
            for (int k = 0; k < arity; ++k) P[k] = now.at[row.at[k]].P;
            link.s = row.compliance * per_dt2;
            link.e = row.kind.residual(P, gradient) + link.s * row.lambda;
            choose_direction(row, now, P, gradient);
            const int child = link.flipped ? 0 : 1;
            link.gradient = gradient[child];
            link.gradient_above = gradient[1 - child];
            link.along = row.along[child];
            link.along_above = row.along[1 - child];
            link.K.setZero();
            if constexpr (has_curvature)
                if (row.before < 0 && row.along == gradient) link.K = -row.before * row.kind.curvature(P);
        }
        const Vec3d root = solve_tree(tree, begin, [&](std::uint32_t i) { return now.at[i].w; });
        now.at[tree.front().parent].P += root;
        for (const Forest::Link& link : tree) {
            rows_[link.row].lambda += link.e;
            now.at[link.child].P += link.moved;
        }
    }

    template <class F>
    void for_each_tree(const F& f) const
    {
        const std::size_t trees = forest_.begin.empty() ? 0 : forest_.begin.size() - 1;
        const auto solve_trees = [&](std::size_t from, std::size_t to) {
            for (std::size_t t = from; t < to; ++t) f(forest_.begin[t], forest_.begin[t + 1]);
        };
        constexpr std::size_t worth_a_task = 256;  // links: tens of microseconds
        if (forest_.links.size() < worth_a_task) return solve_trees(0, trees);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, trees),
                          [&](const auto& range) { solve_trees(range.begin(), range.end()); });
    }

    // Sleepers keep their forces, which multipliers are but for dt².
    void keep_forces(double dt)
    {
        if (dt_ > 0 && dt_ != dt)
            for (Row& row : rows_) row.lambda *= dt / dt_ * (dt / dt_);
        dt_ = dt;
    }

    template <class F>
    void drop(const F& gone)
    {
        if (std::erase_if(rows_, gone) > 0) changed_ = true, listed_ = false;
    }

    // Anew where rows have come or gone, or points have become fixed or free.
    void schedule(const Substep& now)
    {
        std::vector<std::uint8_t> fixed(now.size());
        for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = !(now.at[i].w > 0);
        if (!changed_ && fixed == fixed_) return;
        changed_ = false;
        fixed_ = std::move(fixed);

        std::vector<std::uint32_t> acting, ends;
        for (std::uint32_t r = 0; r < rows_.size(); ++r)
            if (rows_[r].acts && !rows_[r].sleeps)
                acting.push_back(r), ends.insert(ends.end(), rows_[r].at.begin(), rows_[r].at.end());
        forest_ = {};
        if constexpr (direct) {
            forest_ = Forest(ends, now.size(), fixed_);
            for (Forest::Link& link : forest_.links) link.row = acting[link.row];
            std::vector<std::uint32_t> left;
            for (std::uint32_t& r : forest_.leftover) r = acting[r], left.push_back(r);
            acting = std::move(left);
            ends.clear();
            for (const std::uint32_t r : acting) ends.insert(ends.end(), rows_[r].at.begin(), rows_[r].at.end());
        }
        colours_ = Colours(ends, arity, now.size());
        for (std::uint32_t& k : colours_.order) k = acting[k];
    }

    std::vector<Row> rows_;
    std::vector<Ids> known_;  // sorted
    bool listed_ = false;     // all rows are in known_
    bool changed_ = true;
    double dt_ = 0;                      // s, of the last sub-step
    std::vector<std::uint32_t> roused_;  // points whose rows are not what they were
    std::vector<std::uint8_t> fixed_;
    Forest forest_;
    Colours colours_;
};

}  // namespace rapid

// distance: keeps pairs of points at a distance, as rods or as springs.
//
//   C = |P_i - P_j| - rest >= and <= 0        compliance in m/N: 0 for a rod, 1 / stiffness for a spring
//
// Chains and trees of pairs are solved directly at any length (solver/constraints/system_motion.h).
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/rows.h"

#include <fmt/format.h>

namespace rapid {

// Two points by their numbers, from 1, in the first set that enters the node.
struct PointPair {
    int i = 0, j = 0;
};

void read_value(const Param& param, const Value& value, PointPair& pair)
{
    std::vector<int> indices;
    read_value(param, value, indices);
    if (indices.size() != 2)
        throw Error(fmt::format("{} has an entry of {} numbers; each must be two indices, {{i, j}}", param.name,
                                indices.size()));
    pair = {indices[0], indices[1]};
}

namespace {

constexpr double bytes_per_tie = 256;  // a row, and the search for it

// Length, m, below which the square of a length underflows, so that dividing by its root is unsafe.
constexpr double no_length = 1e-150;

struct Tie {
    static constexpr int points = 2;
    static constexpr bool rests = true;

    double rest = 0;                                            // m
    double most = std::numeric_limits<double>::infinity();      // m, of stretch; above it the pair breaks
    double strength = std::numeric_limits<double>::infinity();  // N, of pull; above it the pair breaks
    bool collides = false;                                      // with each other, where there are contacts

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(rest, most, strength, collides);
    }

    double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = P[0] - P[1];
        const double length = d.norm();
        // Two coincident points are separated in an arbitrary direction.
        gradient[0] = length > no_length ? Vec3d(d / length) : Vec3d(Vec3d::UnitY());
        gradient[1] = -gradient[0];
        return length - rest;
    }
    // Returns (d + d')/(|d| + |d'|); for a half turn, which has no such direction, the gradient at the beginning.
    void discrete_gradient(const std::array<Vec3d, 2>& from, const std::array<Vec3d, 2>& to,
                           std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = from[0] - from[1], e = to[0] - to[1], sum = d + e;
        const double lengths = d.norm() + e.norm();
        if (!(lengths > no_length) || !(sum.squaredNorm() > 1e-6 * lengths * lengths))
            return void(residual(from, gradient));
        gradient[0] = sum / lengths;
        gradient[1] = -gradient[0];
    }
    bool breaks(double residual, double pull) const { return residual > most || pull > strength; }
};

class TieConstraint : public RememberingConstraint<TieConstraint, Rows<Tie>> {
public:
    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        memory->follow(points, group);
        return memory->size() > 0 || memory->wakes() ? memory : nullptr;
    }
};

struct Distance {
    std::vector<PointPair> pairs;
    std::optional<double> within, rest, strain, strength;
    double compliance;
    bool collide;
    std::string group;

    static NodeType declare()
    {
        return node<Distance>("distance", "Keeps pairs of points at a distance: rods, ropes, springs.")
            .kind(NodeKind::Dynamic)
            .stage(Stage::Constraints)
            .takes("mass")
            .param(&Distance::pairs, "pairs", Value(), any_number(), "",
                   "pairs {{i, j}, ...} of indices from 1, in the set that first enters the node")
            .constant()
            .param(&Distance::within, "within", Value(), above(0), "m",
                   "distance up to which points form pairs, in the set that first enters the node; instead of pairs")
            .constant()
            .param(&Distance::rest, "rest", Value(), at_least(0), "m",
                   "distance of each pair; the default is its initial distance")
            .constant()
            .param(&Distance::compliance, "compliance", 0.0, at_least(0), "m/N",
                   "stretch per force; 0 makes a rigid rod")
            .constant()
            .param(
                &Distance::strain, "strain", Value(), above(0), "",
                "breaks a spring that is stretched by more than this fraction of its distance; no load stretches a rod")
            .constant()
            .param(&Distance::strength, "strength", Value(), above(0), "N",
                   "breaks a pair that pulls with a larger force; an impact counts as a force over its substep, so "
                   "more substeps break more")
            .constant()
            .param(
                &Distance::collide, "collide", false, any_number(), "",
                "lets the two points of a pair collide; by default they pass through each other, as beads of a rope do")
            .constant();
    }

    void check() const
    {
        if (pairs.empty() == !within.has_value())
            throw Error(pairs.empty() ? "neither pairs nor within is given; give one of them"
                                      : "both pairs and within are given; remove one of them");
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        if (!rows_ && !flow.points.empty()) {
            if (strain && !strength && compliance == 0)
                now.warnings.push_back(
                    fmt::format("node \"{}\": strain = {:g} breaks no rod, because no load stretches a rigid pair; "
                                "give it a compliance, or give strength, the force at which it breaks, N",
                                now.node, *strain));
            rows_ = tie(flow.points);
        }
        if (!rows_) return flow;
        auto constraint = dynamic_of<TieConstraint>(now, group);
        constraint->memory = rows_;
        flow.dynamics.add(std::move(constraint));
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<Distance>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        bool has_rows = rows_ != nullptr;
        keep(has_rows);
        if constexpr (Archive::is_loading::value) rows_ = has_rows ? std::make_shared<Rows<Tie>>() : nullptr;
        if (has_rows) keep(*rows_);
    }

private:
    std::shared_ptr<Rows<Tie>> tie(const PointSet& points) const
    {
        auto rows = std::make_shared<Rows<Tie>>();
        const Strided<Vec3f> P = points.P().read();
        const auto add = [&](std::size_t i, std::size_t j) {
            Tie made;
            made.collides = collide;
            made.rest = rest ? *rest : (P[i].cast<double>() - P[j].cast<double>()).norm();
            if (strain) made.most = *strain * made.rest;
            if (strength) made.strength = *strength;
            rows->add({points.id()[i], points.id()[j]}, made, compliance);
        };
        const int n = static_cast<int>(points.size());
        for (const PointPair& pair : pairs) {
            for (const int k : {pair.i, pair.j})
                if (k < 1 || k > n)
                    throw Error(fmt::format(
                        "pairs names point {}, but the set that first enters the node has points 1 to {}", k, n));
            if (pair.i == pair.j)
                throw Error(fmt::format("pairs connects point {} to itself; give two points", pair.i));
            add(static_cast<std::size_t>(pair.i - 1), static_cast<std::size_t>(pair.j - 1));
        }
        if (!within) return rows;

        std::vector<Vec3d> at(points.size());
        cast(std::span(P.data, P.stride ? points.size() : 0), at);
        if (P.stride == 0) std::fill(at.begin(), at.end(), P[0].cast<double>());
        for (std::size_t i = 0; i < at.size(); ++i)
            if (!at[i].allFinite())
                throw Error(
                    fmt::format("the P of point {} is not finite; correct the node before this one", points.id()[i]));
        const float reach = static_cast<float>(*within / 2);
        const Strided<std::uint8_t> members = members_of(points, group);
        Pairs near;
        ContactSearch().find(at, {&reach, 0}, RadiusGrids({&reach, 0}, at.size(), 0, 1), near,
                             {fmt::format("within = {:g}", *within), "give a smaller within", bytes_per_tie});
        for (std::size_t i = 0; i < at.size(); ++i)
            for (const std::uint32_t j : near.of(i))
                if (members[i] && members[j]) add(i, j);
        return rows;
    }

    std::shared_ptr<Rows<Tie>> rows_;  // null until points have entered
};
RAPID_NODE(Distance);

}  // namespace
}  // namespace rapid

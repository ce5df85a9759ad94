// clump: points that have touched stick together until they are torn apart (paper, figure 7: wet sand, snow, dirt).
//
//   C = |P_i - P_j| - rest, with rest the distance at first contact, at least the sum of the radii;
//   pulls with at most `strength` (N), and breaks if more is needed
//
// A broken bond is removed. The points stick again after they have separated and touched once more. A bond only pulls;
// contact keeps points from penetrating each other.
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/rows.h"

#include <fmt/format.h>

#include <set>

namespace rapid {
namespace {

constexpr double bytes_per_bond = 320;  // a row, its entry in the index of bonds, and the search for it

struct Bond {
    static constexpr int points = 2;
    static constexpr bool one_sided = true;  // C = rest - distance >= 0: pulls only
    static constexpr bool rests = true;

    double rest = 0;      // m
    double strength = 0;  // N

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(rest, strength);
    }

    double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = P[0] - P[1];
        const double length = d.norm();
        gradient[1] = length > 0 ? Vec3d(d / length) : Vec3d(Vec3d::UnitY());
        gradient[0] = -gradient[1];
        return rest - length;
    }
};

// The bonds of a node, over a run. New ones are searched for once per frame, at its beginning.
class Bonds : public Rows<Bond> {
public:
    double strength = 0;                                 // N, in this frame
    std::set<std::array<std::int64_t, 2>> broken_pairs;  // broken, not yet apart: by id, the smaller first

    // Input of the last search: if all points sleep, it is unchanged and finds nothing new.
    struct Searched {
        std::vector<std::int64_t> ids;
        std::vector<Vec3d> at;
        std::vector<float> reach;

        bool operator==(const Searched&) const = default;
        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(ids, at, reach);
        }
    };
    Searched searched;

    template <class Archive>
    void serialize(Archive& keep)
    {
        Rows<Bond>::serialize(keep);
        keep(strength, broken_pairs, searched);
    }

    void solve_velocities(Substep& step) override
    {
        Rows<Bond>::solve_velocities(step);
        break_overloaded([&](const Ids& ids) { broken_pairs.insert(ids); });
    }
};

class ClumpConstraint : public RememberingConstraint<ClumpConstraint, Bonds> {
public:
    std::optional<PerPoint<float>> radius;
    double strength = 0;

    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        bond(points);
        memory->follow(points, group);
        if (strength < std::exchange(memory->strength, strength)) memory->wake_all();
        memory->for_each([&](const auto&, Bond& row) { row.strength = strength; });
        return memory;
    }

private:
    // Bonds all touching pairs that are not bonded yet. A broken bond is forgotten after its points have separated.
    void bond(const PointSet& points) const
    {
        const std::size_t n = points.size();
        const Strided<float> given = radii_of(radius, points);
        const Strided<std::uint8_t> members = members_of(points, group);
        // Points that rest on each other touch within rounding and the error of the solver.
        constexpr float touch = 1.02f;
        const Strided<std::int64_t> id = points.id().read();
        Bonds::Searched now{std::vector<std::int64_t>(n), std::vector<Vec3d>(n), std::vector<float>(n)};
        auto& [ids, at, reach] = now;
        float largest = 0;
        for (std::size_t i = 0; i < n; ++i) {
            reach[i] = members[i] ? touch * given[i] : 0;
            ids[i] = id[i];
            at[i] = points.P()[i].cast<double>();
            largest = std::max(largest, reach[i]);
        }
        if (now == memory->searched) return;
        Pairs near;
        ContactSearch().find(
            at, {reach.data(), 1}, RadiusGrids({reach.data(), 1}, n, {}, 8), near,
            {fmt::format("radius = {:g} m", largest / touch), "give a smaller radius", bytes_per_bond});

        std::set<std::array<std::int64_t, 2>> touching;
        for (std::size_t i = 0; i < n; ++i)
            for (const std::uint32_t j : near.of(i)) {
                const std::array<std::int64_t, 2> pair{std::min(id[i], id[j]), std::max(id[i], id[j])};
                if (memory->broken_pairs.count(pair)) {
                    touching.insert(pair);
                } else if (!memory->has(pair)) {
                    const double touch_at = double(given[i]) + double(given[j]);
                    memory->add(pair, {std::max(touch_at, (at[i] - at[j]).norm()), strength}, 0);
                }
            }
        memory->broken_pairs = std::move(touching);
        memory->searched = std::move(now);
    }
};

struct Clump {
    std::optional<PerPoint<float>> radius;
    double strength;
    std::string group;

    static NodeType declare()
    {
        return node<Clump>("clump", "Bonds touching points until a force tears them apart.")
            .stage(Stage::ContactGrid)
            .stage(Stage::Constraints)
            .takes("pscale")
            .takes("mass")
            .param(&Clump::radius, "radius", Value(), at_least(0), "m",
                   "radius of the points; the default is the attribute pscale, or 0 without it")
            .param(&Clump::strength, "strength", 1.0, at_least(0), "N", "pull at which a bond breaks");
    }

    std::shared_ptr<const Constraint> dynamic(const Evaluation& now) const
    {
        auto constraint = dynamic_of<ClumpConstraint>(now, group);
        constraint->memory = bonds_;
        constraint->radius = radius;
        constraint->strength = strength;
        return constraint;
    }

    static std::unique_ptr<Operator> make() { return stateful<Clump>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(*bonds_);
    }

private:
    std::shared_ptr<Bonds> bonds_ = std::make_shared<Bonds>();
};
RAPID_NODE(Clump);

}  // namespace
}  // namespace rapid

// merge: the points of several chains as one set, in the order of the inputs.
//
// A point that comes by several inputs (the same simulation, the same id) is taken once, from the first of them. The
// result belongs to the first input's simulation. Points of another simulation get ids of this one when they are first
// seen and keep them from frame to frame. Between Create and Solve they are taken in as their own chain yields them:
// its initial points at the first frame, its newborn at the frame of their birth; from then on this simulation's Solve
// moves them. After a Solve both simulations go on by themselves, and the merge is of the output only.
//
// The result has the columns and groups of all inputs. Where a point's own chain had no such column it gets the value
// for points without one.
#include "runtime/graph/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace rapid {
namespace {

// Adds the points of `from` to `into`, with all their columns and groups.
void append_points(PointSet& into, PointSet from, const Evaluation& now)
{
    for (const std::string& name : from.column_names())
        if (!now.keeps(name)) from.remove(name);
    for (const std::string& name : from.group_names())
        if (!now.keeps_group(name)) from.remove_group(name);
    std::vector<AttributeSpec> uniform;
    std::vector<std::string> joined;
    for (const auto& [name, column] : from.columns())
        std::visit(
            [&, &key = name](const auto& c) {
                into.add({key, c.fallback()});
                if (c.is_uniform() && !from.empty()) uniform.push_back({key, c[0]});
            },
            column);
    for (const auto& [name, members] : from.groups()) {
        into.group(name);
        if (members.is_uniform() && !from.empty() && members[0]) joined.push_back(name);
    }
    const std::size_t old = into.size();
    if (from.empty()) return;
    into.append(from.size(), uniform, joined);

    const auto copy_values = [&](auto& column, const auto& added) {
        if (added.is_uniform()) return;
        const std::span tail = column.write().subspan(old);
        std::memcpy(static_cast<void*>(tail.data()), &added[0], tail.size_bytes());
    };
    for (const auto& [name, column] : from.columns())
        std::visit([&, &key = name](const auto& c) { copy_values(into.column<std::decay_t<decltype(c[0])>>(key), c); },
                   column);
    for (const auto& [name, members] : from.groups()) copy_values(into.group(name), members);
}

// Ids of points that are in the result already.
class Taken {
public:
    // False where it was in already.
    bool insert(std::int64_t id)
    {
        const auto i = static_cast<std::size_t>(id);
        if (i >= taken_.size()) taken_.resize(std::max(i + 1, taken_.size() * 2), false);
        if (taken_[i]) return false;
        return taken_[i] = true;
    }

private:
    std::vector<bool> taken_;  // ids are dense from 0
};

struct Merge {
    static NodeType declare()
    {
        return node<Merge>("merge", "Joins the points of several chains; what comes by several is taken once.")
            .kind(NodeKind::Merge)
            .reads("id")
            .writes("id");
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now) const { return evaluate(inputs, now); }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) const
    {
        Flow result = std::move(inputs[0]);
        Taken taken;
        const Strided<std::int64_t> ids = std::as_const(result.points).id().read();
        for (std::size_t i = 0; i < result.points.size(); ++i) taken.insert(ids[i]);
        for (std::size_t i = 1; i < inputs.size(); ++i) {
            try {
                take(result, taken, std::move(inputs[i]), now);
            } catch (Error& error) {
                throw Error(fmt::format("input {}: {}", i + 1, error.message()));
            }
        }
        return result;
    }

private:
    static void take(Flow& result, Taken& taken, Flow input, const Evaluation& now)
    {
        Simulation& here = *result.simulation;
        const Simulation& there = *input.simulation;
        if (there.fps != here.fps)
            throw Error(fmt::format("it runs at {} frames a second, input 1 at {}; give both the same fps", there.fps,
                                    here.fps));
        PointSet& points = input.points;
        if (&there != &here && !points.empty()) {
            AdoptedIds& adopted = here.adopted[&there];
            for (std::int64_t& id : points.id().write()) id = adopted.of(id, here.next_id);
        }
        std::vector<std::uint8_t> fresh(points.size());
        const Strided<std::int64_t> ids = std::as_const(points).id().read();
        for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = taken.insert(ids[i]);
        points.keep(fresh);
        append_points(result.points, std::move(points), now);

        result.dynamics.merge(input.dynamics);
    }
};
RAPID_NODE(Merge);

}  // namespace
}  // namespace rapid

// merge: joins the points of several chains into one set, in the order of the inputs.
//
// The result belongs to the simulation of the first input. A point that several inputs have (of the same simulation,
// with the same id) is taken from the first of these. A point of another simulation gets an id of this one when it
// first appears, and keeps it in later frames.
//
// Between Create and Solve, points of another simulation are adopted as their own chain outputs them: its initial
// points at the first frame, newborn points at the frame of their birth. From then on this simulation's Solve moves
// them. After a Solve both simulations continue independently, and only the output is merged.
//
// The result has the columns and groups of all inputs. A point from a chain without a column gets the column's
// fallback value.
#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/stateful.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>

namespace rapid {
namespace {

// Appends the points of `from` to `into`, with all their columns and groups.
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

// Returns the nodes upstream of a node, including itself, by index in the plan.
std::set<std::size_t> upstream_of(const Plan& plan, std::size_t node)
{
    std::set<std::size_t> found;
    std::vector<std::size_t> open = {node};
    while (!open.empty()) {
        const std::size_t at = open.back();
        open.pop_back();
        if (!found.insert(at).second) continue;
        open.insert(open.end(), plan.nodes[at].inputs.begin(), plan.nodes[at].inputs.end());
    }
    return found;
}

bool removes_points(const PlannedNode& node)
{
    const PointEdit* edit = node.op->as_point_edit();
    return node.node->type->kind == NodeKind::Solve || (edit && edit->removes_points());
}

// Returns true if points of one simulation are in the order of their ids after a merge. The points of the first input
// come first, then points that only the second has, and so on: newborn points, in the evaluation order of their
// emitters, and points that an earlier input has removed.
bool keeps_order(const Plan& plan, const PlannedNode& merge)
{
    std::set<std::size_t> before;  // upstream of the inputs so far
    std::size_t last_emitter = 0;
    for (const std::size_t input : merge.inputs) {
        const std::set<std::size_t> here = upstream_of(plan, input);
        for (const std::size_t node : here)
            if (plan.nodes[node].node->type->has(Stage::Emission) && !before.count(node) && node < last_emitter)
                return false;
        for (const std::size_t node : before)
            if (!here.count(node) && removes_points(plan.nodes[node])) return false;
        before.insert(here.begin(), here.end());
        for (const std::size_t node : before)
            if (plan.nodes[node].node->type->has(Stage::Emission)) last_emitter = std::max(last_emitter, node);
    }
    return true;
}

// Limit of ids in a snapshot: they are processed one by one, in a few seconds at most.
constexpr std::int64_t max_adopted = std::int64_t{1} << 31;

// The ids of the points in the result.
class IdSet {
public:
    // Returns false if it was in the set already.
    bool insert(std::int64_t id)
    {
        const auto i = static_cast<std::size_t>(id);
        if (i >= has_.size()) has_.resize(std::max(i + 1, has_.size() * 2), false);
        if (has_[i]) return false;
        return has_[i] = true;
    }

private:
    std::vector<bool> has_;  // ids are dense from 0
};

struct Merge {
    static NodeType declare()
    {
        return node<Merge>("merge",
                           "Joins the points of several chains; a point that arrives by several chains is taken once.")
            .kind(NodeKind::Merge)
            .reads("id")
            .writes("id");
    }

    std::string couples(const Plan& plan, const PlannedNode& node) const
    {
        if (node.carries.size() > 1) return "numbers the points of several simulations in the order in which they come";
        return keeps_order(plan, node)
                   ? ""
                   : "joins its inputs in another order than that of their ids, so parts could not be merged";
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now)
    {
        adopted_.clear();
        return evaluate(inputs, now);
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow result = std::move(inputs[0]);
        IdSet ids_in_result;
        const Strided<std::int64_t> ids = std::as_const(result.points).id().read();
        for (std::size_t i = 0; i < result.points.size(); ++i) ids_in_result.insert(ids[i]);
        for (std::size_t i = 1; i < inputs.size(); ++i) {
            try {
                append_input(result, ids_in_result, i, std::move(inputs[i]), now);
            } catch (Error& error) {
                throw Error(fmt::format("input {}: {}", i + 1, error.message()), error.kind());
            }
        }
        return result;
    }

    static std::unique_ptr<Operator> make() { return stateful<Merge>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(adopted_);
    }
    void resume(const NodeSimulations& simulations) const
    {
        std::int64_t left = max_adopted;
        for (const Run& run : adopted_) {
            StateReader::expect(run.input < simulations.inputs.size() && run.first >= 0 && run.size >= 0 &&
                                run.first <= INT64_MAX - run.size && run.adopted >= 0 && run.size <= left &&
                                run.size <= simulations.own.next_id - run.adopted);
            left -= run.size;
            AdoptedIds& ids = simulations.own.adopted[simulations.inputs[run.input]];
            for (std::int64_t k = 0; k < run.size; ++k) {
                std::int64_t next = run.adopted + k;
                ids.of(run.first + k, next);
            }
        }
    }

private:
    // Points that this node has adopted, with consecutive ids.
    struct Run {
        std::uint64_t input;
        std::int64_t first, size;  // ids in the simulation of the input
        std::int64_t adopted;      // id of the first here

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(input, first, size, adopted);
        }
    };

    void note_adopted(std::size_t input, std::int64_t id, std::int64_t adopted)
    {
        Run* last = adopted_.empty() ? nullptr : &adopted_.back();
        if (last && last->input == input && last->first + last->size == id && last->adopted + last->size == adopted)
            ++last->size;
        else
            adopted_.push_back({input, id, 1, adopted});
    }

    void append_input(Flow& result, IdSet& ids_in_result, std::size_t number, Flow input, const Evaluation& now)
    {
        Simulation& here = *result.simulation;
        const Simulation& there = *input.simulation;
        if (there.fps != here.fps)
            throw Error(fmt::format("it runs at {} frames per second and input 1 at {}; give both the same fps",
                                    there.fps, here.fps));
        PointSet& points = input.points;
        if (&there != &here && !points.empty()) {
            AdoptedIds& adopted = here.adopted[&there];
            for (std::int64_t& id : points.id().write()) {
                const std::int64_t next = here.next_id, there_id = std::exchange(id, adopted.of(id, here.next_id));
                if (here.next_id != next) note_adopted(number, there_id, next);
            }
        }
        std::vector<std::uint8_t> fresh(points.size());
        const Strided<std::int64_t> ids = std::as_const(points).id().read();
        for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = ids_in_result.insert(ids[i]);
        points.keep(fresh);
        append_points(result.points, std::move(points), now);

        result.dynamics.merge(input.dynamics);
    }

    std::vector<Run> adopted_;  // in this run, for snapshots
};
RAPID_NODE(Merge);
RAPID_COUPLING("merge", Merge);

}  // namespace
}  // namespace rapid

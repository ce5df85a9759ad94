#include "bindings/run/races.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "runtime/graph/evaluate.h"
#include "runtime/graph/point_function.h"

namespace rapid {
namespace {

// The points after a node, at a frame.
struct NodePoints {
    std::string node;
    Location location;
    std::int64_t frame;
    PointSet points;
};

struct Difference {
    const NodePoints* result;       // of the run in order, the first that differs
    std::string what, here, there;  // "heat of point id 3", "1", "2"
};

std::string value_text(float value) { return fmt::format("{:.9g}", value); }
std::string value_text(double value) { return fmt::format("{:.17g}", value); }
std::string value_text(std::int32_t value) { return fmt::format("{}", value); }
std::string value_text(std::int64_t value) { return fmt::format("{}", value); }
std::string value_text(const Vec3f& v) { return fmt::format("vec3({:.9g}, {:.9g}, {:.9g})", v.x(), v.y(), v.z()); }
std::string value_text(const Vec3d& v) { return fmt::format("vec3({:.17g}, {:.17g}, {:.17g})", v.x(), v.y(), v.z()); }
std::string value_text(const Quatf& q)
{
    return fmt::format("quat({:.9g}, {:.9g}, {:.9g}, {:.9g})", q.x(), q.y(), q.z(), q.w());
}
std::string value_text(Token text) { return fmt::format("\"{}\"", text.text()); }
std::string value_text(const DetailValue& value)
{
    return std::visit([](const auto& v) { return value_text(v); }, value);
}

template <class T>
std::optional<std::size_t> first_unequal(const Column<T>& a, const Column<T>& b)
{
    const Strided<T> here = a.read(), there = b.read();
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::memcmp(&here[i], &there[i], sizeof(T)) != 0) return i;
    return std::nullopt;
}

std::optional<Difference> compare_columns(const PointSet& a, const PointSet& b)
{
    for (const auto& [name, column] : a.columns()) {
        const AnyColumn* other = b.find(name);
        if (!other || other->index() != column.index())
            return Difference{nullptr, fmt::format("the attribute {}", name), "there",
                              other ? "of another type" : "not"};
        auto found = std::visit(
            [&, &name = name]<class T>(const Column<T>& here) -> std::optional<Difference> {
                const auto& there = std::get<Column<T>>(*other);
                const std::optional<std::size_t> i = first_unequal(here, there);
                if (!i) return std::nullopt;
                return Difference{nullptr, fmt::format("{} of point id {}", name, a.id()[*i]), value_text(here[*i]),
                                  value_text(there[*i])};
            },
            column);
        if (found) return found;
    }
    return std::nullopt;
}

std::optional<Difference> compare_groups(const PointSet& a, const PointSet& b)
{
    for (const auto& [name, members] : a.groups()) {
        const Column<std::uint8_t>* other = b.find_group(name);
        if (!other) return Difference{nullptr, fmt::format("the group {}", name), "there", "not"};
        if (const auto i = first_unequal(members, *other))
            return Difference{nullptr, fmt::format("point id {}", a.id()[*i]),
                              fmt::format("{} the group {}", members[*i] ? "in" : "out of", name),
                              members[*i] ? "out of it" : "in it"};
    }
    return std::nullopt;
}

std::optional<Difference> compare_details(const PointSet& a, const PointSet& b)
{
    for (const auto& [name, value] : a.details) {
        const auto other = b.details.find(name);
        const std::string there = other == b.details.end() ? "missing" : value_text(other->second);
        if (value_text(value) != there)
            return Difference{nullptr, fmt::format("the detail value {}", name), value_text(value), there};
    }
    return std::nullopt;
}

// Returns the first bitwise difference of two sets that should be equal.
std::optional<Difference> compare(const PointSet& a, const PointSet& b)
{
    // If ids differ, because points were killed or sorted, their values are irrelevant.
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        if (a.id()[i] != b.id()[i])
            return Difference{nullptr, fmt::format("the id at index {}", i + 1), value_text(a.id()[i]),
                              value_text(b.id()[i])};
    if (a.size() != b.size())
        return Difference{nullptr, "the number of points", fmt::format("{}", a.size()), fmt::format("{}", b.size())};
    if (auto found = compare_columns(a, b)) return found;
    if (auto found = compare_groups(a, b)) return found;
    return compare_details(a, b);
}

void advance_all(Evaluator& evaluator, const Plan& plan, const RunFrames& frames)
{
    for (std::int64_t frame = plan.first_frame(); frame <= frames.last; ++frame) evaluator.advance();
}

std::vector<NodePoints> results_in_order(const Plan& plan, const RunFrames& frames)
{
    std::vector<NodePoints> results;
    Evaluator evaluator(plan, {}, [&](const Node& node, std::int64_t frame, const PointSet& points) {
        if (frames.contains(frame)) results.push_back({node.name, node.location, frame, points});
    });
    advance_all(evaluator, plan, frames);
    return results;
}

struct Trials {
    const LoadInOrder& load;
    const PlanOptions& options;
    const RunFrames& frames;
    const std::vector<NodePoints>& expected;

    // Computes the frames in another order, and compares the result of each node.
    std::optional<Difference> run(const KernelOrder& order) const
    {
        const std::unique_ptr<Session> session = load(order);
        const Plan plan(session->graph(), options);
        std::optional<Difference> first;
        std::size_t next = 0;
        Evaluator evaluator(plan, {}, [&](const Node&, std::int64_t frame, const PointSet& points) {
            if (!frames.contains(frame)) return;
            const NodePoints& result = expected[next++];
            if (first) return;
            first = compare(result.points, points);
            if (first) first->result = &result;
        });
        advance_all(evaluator, plan, frames);
        return first;
    }
};

bool has_kernel(const Node& node)
{
    for (const auto& [name, argument] : node.arguments) {
        const auto* object = argument.get<ObjectPtr>();
        if (object && std::dynamic_pointer_cast<const PointFunction>(*object)) return true;
    }
    return false;
}

// The effect of an action shows only after its Solve, and that of a kernel may show only in later nodes. Therefore each
// kernel of the plan is run alone in the other order: the first one that makes a difference is the culprit. Failing
// that, it is the node after which a difference was seen.
std::pair<Difference, const Node*> find_culprit(const Trials& trials, const Plan& plan, const Difference& seen,
                                                KernelOrder order)
{
    const Node* last = nullptr;
    for (const PlannedNode& planned : plan.nodes) {
        if (planned.node->name == seen.result->node) last = planned.node.get();
        if (!has_kernel(*planned.node)) continue;
        order.node = planned.node->name;
        if (const auto alone = trials.run(order)) return {*alone, planned.node.get()};
    }
    return {seen, last};
}

}  // namespace

Races races_in(const LoadInOrder& load, const Plan& plan, const PlanOptions& options, const RunFrames& frames)
{
    const std::vector<NodePoints> expected = results_in_order(plan, frames);
    Races races;
    races.compared =
        std::any_of(expected.begin(), expected.end(), [](const NodePoints& result) { return !result.points.empty(); });
    const Trials trials{load, options, frames, expected};
    for (const KernelOrder::Sequence sequence : {KernelOrder::Reversed, KernelOrder::TwoStates}) {
        const KernelOrder order{sequence, ""};
        const std::optional<Difference> seen = trials.run(order);
        if (!seen) continue;
        const auto [found, culprit] = find_culprit(trials, plan, *seen, order);
        const std::string after =
            culprit->name == found.result->node ? "" : fmt::format(" after node \"{}\"", found.result->node);
        Error error(fmt::format(
            "frame {}: {}{} is {} in the order of the points, and {} {}; a kernel must not remember other points: "
            "store values in an attribute of the point, or compute them once for all points in a :detail",
            found.result->frame, found.what, after, found.here, found.there,
            sequence == KernelOrder::Reversed ? "in reverse order"
                                              : "if every other point is processed by a second Lua state"));
        error.at(culprit->location).in_node(culprit->name);
        races.found = std::move(error);
        return races;
    }
    return races;
}

}  // namespace rapid

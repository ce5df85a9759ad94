#include "runtime/graph/doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "runtime/graph/node_handle.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/points_object.h"

namespace rapid {
namespace {

std::string warning_of(const Node& node, const std::string& text)
{
    return fmt::format("{}:{}: node \"{}\": {}", node.location.file, node.location.line, node.name, text);
}

bool names(const std::vector<std::string>& list, std::string_view name)
{
    return std::find(list.begin(), list.end(), name) != list.end();
}

bool comes(const PlannedSimulation& simulation, std::string_view name)
{
    const PlannedAttribute* attribute = simulation.find(name);
    return attribute && (!attribute->made_by.empty() || !attribute->written_by.empty());
}

bool comes_to(const Plan& plan, const PlannedNode& reader, std::string_view name)
{
    return std::any_of(reader.carries.begin(), reader.carries.end(),
                       [&](std::size_t simulation) { return comes(plan.simulations[simulation], name); });
}

// Nodes whose result nobody takes. Of a chain that is left out as a whole, and of one that ends in a Solve, the author
// may know.
void warn_of_dropped_nodes(const Graph& graph, const Plan& plan, std::vector<std::string>& warnings)
{
    std::set<const Node*> taken, reached;
    for (const NodePtr& node : graph.nodes) {
        for (const NodePtr& input : node->inputs) taken.insert(input.get());
        for (const auto& [name, value] : node->arguments)
            if (const auto source = value.object<NodeHandle>()) taken.insert(source->node.get());
    }
    for (const PlannedNode& planned : plan.nodes) reached.insert(planned.node.get());
    for (const NodePtr& node : plan.left_out) {
        const std::string& type = node->type->name;
        const bool ends = node->type->kind == NodeKind::Solve || node->inputs.empty();
        const bool is_told = type == "write" || type == "rasterize";  // by the plan
        if (ends || is_told || taken.count(node.get()) || !reached.count(node->inputs.front().get())) continue;
        warnings.push_back(warning_of(
            *node,
            fmt::format("leads to no output, as its result is dropped; keep it: chain = chain:{} {{ ... }}", type)));
    }
}

// A script that looks at the age as a part of the life.
void warn_of_missing_lives(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedNode& planned : plan.nodes) {
        const auto& arguments = planned.node->arguments;
        const auto is_script = [](const auto& argument) { return argument.second.template object<PointFunction>(); };
        if (std::none_of(arguments.begin(), arguments.end(), is_script)) continue;
        const std::vector<std::string> reads = uses_of(planned).reads;
        if (!names(reads, "age") || !names(reads, "life") || comes_to(plan, planned, "life")) continue;
        warnings.push_back(
            warning_of(*planned.node, "its points live for ever, so their age is no part of a life; give emit a life"));
    }
}

// Angular velocities that turn nothing.
void warn_of_idle_spins(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedSimulation& simulation : plan.simulations) {
        const PlannedAttribute* w = simulation.find("w");
        if (!w || w->made_by.empty() || !w->read_by.empty()) continue;
        warnings.push_back(warning_of(*plan.nodes[w->made_by.front()].node,
                                      "makes w, by which nothing turns; add :tumble {}, or give :contact spin = true"));
    }
}

bool is_at_rest(const PointSet& points)
{
    const Column<Vec3f>& v = points.v();
    for (std::size_t i = 0; i < points.size(); ++i)
        if (v[i] != Vec3f::Zero()) return false;
    return true;
}

// Returns false only if all points of the emitter are born at rest.
bool may_emit_velocity(const Node& emit)
{
    for (const char* name : {"velocity", "speed"})
        if (emit.arguments.count(name)) return true;
    if (const auto birth = emit.arguments.find("birth"); birth != emit.arguments.end())
        if (const auto kernel = birth->second.object<PointFunction>()) {
            Uses uses;
            kernel->uses(uses);
            if (names(uses.writes, "v")) return true;
        }
    const auto source = emit.arguments.find("source");
    const ObjectPtr* object = source == emit.arguments.end() ? nullptr : source->second.get<ObjectPtr>();
    if (!object || (*object)->varies()) return true;
    const auto points = source->second.object<PointsObject>();
    return points && !is_at_rest(points->points);
}

// Returns false only if the node gives no point a velocity.
bool may_give_velocity(const PlannedNode& planned)
{
    const Node& node = *planned.node;
    switch (node.type->kind) {
        case NodeKind::Source: {
            const auto points = node.arguments.find("points");
            const auto initial = points == node.arguments.end() ? nullptr : points->second.object<PointsObject>();
            return initial && !is_at_rest(initial->points);
        }
        case NodeKind::Solve:
            return false;
        case NodeKind::Points:
            return node.type->name == "emit" ? may_emit_velocity(node) : names(uses_of(planned).writes, "v");
        default:
            return true;
    }
}

// Kernels that assign P in chains in which nothing gives points a velocity.
void warn_of_moves_without_velocity(const Plan& plan, std::vector<std::string>& warnings)
{
    for (std::size_t s = 0; s < plan.simulations.size(); ++s) {
        const auto moves_alone = [&](const PlannedNode& planned) {
            return planned.in_loop && planned.carries.count(s) && planned.node->type->name == "points" &&
                   names(uses_of(planned).writes, "P");
        };
        const auto mover = std::find_if(plan.nodes.begin(), plan.nodes.end(), moves_alone);
        if (!plan.simulations[s].solve || mover == plan.nodes.end()) continue;
        if (std::any_of(plan.nodes.begin(), plan.nodes.end(), [&](const PlannedNode& planned) {
                return planned.carries.count(s) && may_give_velocity(planned);
            }))
            continue;
        warnings.push_back(
            warning_of(*mover->node,
                       "moves P and leaves v at 0, so that files and motion blur have no velocities; assign "
                       "p.v = (place - p.P) / frame.dt instead of p.P, and :solve moves the point there"));
    }
}

}  // namespace

std::vector<std::string> doubts_about(const Graph& graph, const Plan& plan)
{
    std::vector<std::string> warnings;
    warn_of_dropped_nodes(graph, plan, warnings);
    warn_of_missing_lives(plan, warnings);
    warn_of_idle_spins(plan, warnings);
    warn_of_moves_without_velocity(plan, warnings);
    return warnings;
}

}  // namespace rapid

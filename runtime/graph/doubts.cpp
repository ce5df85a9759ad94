#include "runtime/graph/doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "runtime/graph/node_handle.h"
#include "runtime/graph/point_function.h"

namespace rapid {
namespace {

std::string warning_of(const Node& node, const std::string& text)
{
    return fmt::format("{}:{}: node \"{}\": {}", node.location.file, node.location.line, node.name, text);
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
        const auto names = [&](const char* name) { return std::find(reads.begin(), reads.end(), name) != reads.end(); };
        if (!names("age") || !names("life") || comes_to(plan, planned, "life")) continue;
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

}  // namespace

std::vector<std::string> doubts_about(const Graph& graph, const Plan& plan)
{
    std::vector<std::string> warnings;
    warn_of_dropped_nodes(graph, plan, warnings);
    warn_of_missing_lives(plan, warnings);
    warn_of_idle_spins(plan, warnings);
    return warnings;
}

}  // namespace rapid

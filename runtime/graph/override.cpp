#include "runtime/graph/override.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "runtime/base/at_node.h"
#include "runtime/graph/arguments.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/registry.h"

namespace rapid {
namespace {

const Node& find_node(const Graph& graph, const std::string& path, const std::string& target)
{
    std::vector<std::string> names, of_type;
    const Node* found = nullptr;
    for (const NodePtr& node : graph.nodes) {
        if (node->name == target) return *node;
        names.push_back(node->name);
        if (node->type->name != target) continue;
        of_type.push_back(node->name);
        found = node.get();
    }
    if (of_type.size() == 1) return *found;
    if (of_type.size() > 1)
        throw Error(fmt::format("{}: {} nodes have the type {}; give one of {}", path, of_type.size(), target,
                                fmt::join(of_type, ", ")));
    for (const NodePtr& node : graph.nodes) names.push_back(node->type->name);
    throw Error(fmt::format("{}: the graph has no node \"{}\"{}", path, target, did_you_mean(target, names)));
}

// Returns the graph with copies of its nodes, connected to each other. Calls change(copy, node) for each.
template <class F>
Graph copied(const Graph& graph, const F& change)
{
    Graph result;
    result.file = graph.file;
    std::map<const Node*, NodePtr> copies;
    for (const NodePtr& node : graph.nodes) {  // inputs and sources come before their consumers
        const std::shared_ptr<Node> copy = make_node(*node);
        for (NodePtr& input : copy->inputs) input = copies.at(input.get());
        for (std::pair<const std::string, Value>& argument : copy->arguments)
            if (const auto source = argument.second.object<NodeHandle>())
                argument.second = Value(std::make_shared<NodeHandle>(copies.at(source->node.get())));
        change(*copy, *node);
        copies[node.get()] = copy;
        result.nodes.push_back(std::move(copy));
    }
    for (const auto& [name, node] : graph.outputs) result.outputs[name] = copies.at(node.get());
    return result;
}

}  // namespace

Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values)
{
    std::map<const Node*, std::map<std::string, Value>> changes;
    for (const auto& [path, value] : values) {
        const std::size_t dot = path.rfind('.');
        if (dot == std::string::npos || dot == 0 || dot + 1 == path.size())
            throw Error(fmt::format(
                "\"{}\" is not a parameter of a node; it must be NODE.PARAM, such as solve.substeps", path));
        const Node& node = find_node(graph, path, path.substr(0, dot));
        const std::string param = path.substr(dot + 1);
        name_errors(node.name, node.location, [&] { require_param(*node.type, param); });
        changes[&node][param] = value;
    }

    return copied(graph, [&](Node& copy, const Node& node) {
        if (const auto found = changes.find(&node); found != changes.end())
            for (const auto& [name, value] : found->second) copy.arguments[name] = value;
    });
}

Graph with_unique_names(const Graph& graph, const std::function<bool(const Node&)>& may_be_renamed)
{
    std::set<const Node*> reached;
    std::vector<const Node*> open;
    for (const auto& [name, node] : graph.outputs) open.push_back(node.get());
    while (!open.empty()) {
        const Node* node = open.back();
        open.pop_back();
        if (!reached.insert(node).second) continue;
        for (const NodePtr& input : node->inputs) open.push_back(input.get());
        for (const auto& [name, argument] : node->arguments)
            if (const auto source = argument.object<NodeHandle>()) open.push_back(source->node.get());
    }

    std::set<std::string> names, used;
    for (const NodePtr& node : graph.nodes) names.insert(node->name);
    std::map<const Node*, std::string> renamed;
    for (const NodePtr& node : graph.nodes) {
        if (!reached.count(node.get()) || used.insert(node->name).second || !may_be_renamed(*node)) continue;
        int number = 2;
        while (!names.insert(fmt::format("{}{}", node->name, number)).second) ++number;
        renamed[node.get()] = fmt::format("{}{}", node->name, number);
    }
    if (renamed.empty()) return graph;
    return copied(graph, [&](Node& copy, const Node& node) {
        if (const auto found = renamed.find(&node); found != renamed.end()) copy.name = found->second;
    });
}

}  // namespace rapid

#include "runtime/graph/override.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/at_node.h"
#include "runtime/graph/arguments.h"
#include "runtime/graph/make_node.h"
#include "runtime/graph/node_handle.h"
#include "runtime/graph/registry.h"

namespace rapid {
namespace {

const Node& find_node(const Graph& graph, const std::string& path, const std::string& wanted)
{
    std::vector<std::string> names, of_type;
    const Node* found = nullptr;
    for (const NodePtr& node : graph.nodes) {
        if (node->name == wanted) return *node;
        names.push_back(node->name);
        if (node->type->name != wanted) continue;
        of_type.push_back(node->name);
        found = node.get();
    }
    if (of_type.size() == 1) return *found;
    if (of_type.size() > 1)
        throw Error(fmt::format("{}: {} nodes are of the type {}; name one of {}", path, of_type.size(), wanted,
                                fmt::join(of_type, ", ")));
    for (const NodePtr& node : graph.nodes) names.push_back(node->type->name);
    throw Error(fmt::format("{}: the graph has no node \"{}\"{}", path, wanted, did_you_mean(wanted, names)));
}

}  // namespace

Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values)
{
    std::map<const Node*, std::map<std::string, Value>> changes;
    for (const auto& [path, value] : values) {
        const std::size_t dot = path.rfind('.');
        if (dot == std::string::npos || dot == 0 || dot + 1 == path.size())
            throw Error(
                fmt::format("\"{}\" is no parameter of a node; it must be NODE.PARAM, as solve.substeps", path));
        const Node& node = find_node(graph, path, path.substr(0, dot));
        const std::string param = path.substr(dot + 1);
        name_errors(node.name, node.location, [&] { require_param(*node.type, param); });
        changes[&node][param] = value;
    }

    Graph result;
    result.file = graph.file;
    std::map<const Node*, NodePtr> replaced;
    for (const NodePtr& node : graph.nodes) {  // inputs and sources come before their consumers
        auto copy = make_node(*node);
        for (NodePtr& input : copy->inputs) input = replaced.at(input.get());
        for (auto& [name, argument] : copy->arguments)
            if (const auto source = argument.object<NodeHandle>())
                argument = Value(std::make_shared<NodeHandle>(replaced.at(source->node.get())));
        if (const auto found = changes.find(node.get()); found != changes.end())
            for (const auto& [name, value] : found->second) copy->arguments[name] = value;
        replaced[node.get()] = copy;
        result.nodes.push_back(std::move(copy));
    }
    for (const auto& [name, node] : graph.outputs) result.outputs[name] = replaced.at(node.get());
    return result;
}

}  // namespace rapid

#include "runtime/graph/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <new>
#include <vector>

namespace rapid {
namespace {

// Nodes that the outermost end() of this thread has yet to delete.
thread_local std::vector<Node*>* waiting = nullptr;

void end(Node* node)
{
    if (waiting) try {
            return waiting->push_back(node);
        } catch (const std::bad_alloc&) {  // then delete it recursively
        }
    if (waiting) return delete node;
    std::vector<Node*> nodes;
    waiting = &nodes;
    for (delete node; !nodes.empty();) {
        Node* const next = nodes.back();
        nodes.pop_back();
        delete next;
    }
    waiting = nullptr;
}

}  // namespace

std::shared_ptr<Node> make_node(const Node& node) { return {new Node(node), end}; }

namespace {

// Filled during static initialisation, in link order. A function-local static, so that it exists before the first
// registration.
std::vector<NodeType (*)()>& declarations()
{
    static std::vector<NodeType (*)()> all;
    return all;
}

// One thread may load a plugin while another opens a scene.
std::mutex& declarations_mutex()
{
    static std::mutex mutex;
    return mutex;
}

}  // namespace

const Param* NodeType::find(std::string_view param) const
{
    const auto found = std::find_if(params.begin(), params.end(), [&](const Param& p) { return p.name == param; });
    return found == params.end() ? nullptr : &*found;
}

std::vector<std::string> NodeType::param_names() const
{
    std::vector<std::string> names;
    for (const Param& param : params)
        if (!param.internal) names.push_back(param.name);
    return names;
}

NodeRegistration::NodeRegistration(NodeType (*declare)())
{
    const std::lock_guard lock(declarations_mutex());
    declarations().push_back(declare);
}

Registry::Registry()
{
    const auto all = [] {
        const std::lock_guard lock(declarations_mutex());
        return declarations();
    }();
    for (NodeType (*declare)() : all) add(declare());
}

const NodeType& Registry::add(NodeType type)
{
    if (find(type.name))
        throw Error(fmt::format("a node \"{}\" exists already; give the new one another name", type.name));
    return types_.emplace_back(std::move(type));
}

const NodeType* Registry::find(std::string_view name) const
{
    const auto found = std::find_if(types_.begin(), types_.end(), [&](const NodeType& t) { return t.name == name; });
    return found == types_.end() ? nullptr : &*found;
}

const NodeType& Registry::at(std::string_view name) const
{
    if (const NodeType* found = find(name)) return *found;
    std::vector<std::string> names;
    for (const NodeType* type : types()) names.push_back(type->name);
    const std::string nearest = did_you_mean(name, names);
    throw Error(
        fmt::format("unknown node \"{}\"{}", name, nearest.empty() ? "; `rapid nodes` lists all nodes" : nearest));
}

std::vector<const NodeType*> Registry::types() const
{
    std::vector<const NodeType*> sorted;
    for (const NodeType& type : types_) sorted.push_back(&type);
    std::sort(sorted.begin(), sorted.end(), [](const NodeType* a, const NodeType* b) { return a->name < b->name; });
    return sorted;
}

}  // namespace rapid

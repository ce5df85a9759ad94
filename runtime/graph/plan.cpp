#include "runtime/graph/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "runtime/graph/registry.h"

namespace rapid {
namespace {

// Runs f and gives an Error that rises from it the node's name and place.
template <class F>
void at_node(const Node& node, const F& f)
{
    try {
        f();
    } catch (Error& error) {
        error.in_node(node.name).at(node.location);
        throw;
    }
}

// An argument that is never a function, or the parameter's default.
double constant_argument(const Node& node, std::string_view param)
{
    const auto given = node.arguments.find(std::string(param));
    const Value& value = given == node.arguments.end() ? node.type->find(param)->fallback : given->second;
    const double* number = value.get<double>();
    return number ? *number : 0;
}

// Uses of a node: those of its type and those of its arguments.
Uses uses_of(const PlannedNode& planned)
{
    Uses uses = planned.node->type->uses;
    planned.op->uses(uses);
    for (const auto& [name, value] : planned.node->arguments)
        if (const auto* reference = value.get<AttributeRef>()) uses.reads.push_back(reference->name);
    return uses;
}

// Whether a value is another at each frame: a function, a motion, what is moved, or a table that holds one.
bool varies(const Value& value)
{
    if (value.function()) return true;
    if (const ObjectPtr* object = value.get<ObjectPtr>()) return *object && (*object)->varies();
    const Table* table = value.table();
    if (!table) return false;
    const auto entry_varies = [](const auto& entry) { return varies(entry.second); };
    return std::any_of(table->list.begin(), table->list.end(), [](const Value& entry) { return varies(entry); }) ||
           std::any_of(table->numbered.begin(), table->numbered.end(), entry_varies) ||
           std::any_of(table->named.begin(), table->named.end(), entry_varies);
}

bool has_varying_argument(const Node& node)
{
    return std::any_of(node.arguments.begin(), node.arguments.end(),
                       [](const auto& argument) { return varies(argument.second); });
}

// Asks a function of the frame. An Error of it tells the frame.
void assign_at(const Param& param, Operator& op, const FrameFunction& function, const Frame& frame)
{
    try {
        const Value result = function.call(frame);
        if (result.is_nil()) wrong_type(param, result);
        if (result.function()) throw Error(fmt::format("{} is a function that returned a function", param.name));
        param.assign(param, op.fields(), result);
    } catch (const Error& error) {
        Error placed(fmt::format("{} (frame {})", error.message(), frame.number));
        placed.at(error.location()).with_trace(error.trace());
        throw placed;
    }
}

}  // namespace

void bind_arguments(const Node& node, Operator& op, const Frame& frame, bool only_functions)
{
    for (const auto& [name, value] : node.arguments) {
        const Param* param = node.type->find(name);
        Param any;
        if (!param) {
            if (!node.type->rest)
                throw Error(
                    fmt::format("unknown parameter \"{}\"{}", name, did_you_mean(name, node.type->param_names())));
            any = *node.type->rest;
            any.name = name;
            param = &any;
        }
        if (const FrameFunction* function = value.function(); function && !param->keeps_function) {
            if (!param->of_the_frame)
                throw Error(fmt::format("{} can't be a function of the frame; it must be a constant", name));
            assign_at(*param, op, *function, frame);
        } else if (!only_functions) {
            param->assign(*param, op.fields(), value);
        }
    }
    if (only_functions) return;
    for (const Param& param : node.type->params) {
        if (node.arguments.count(param.name)) continue;
        if (param.required) throw Error(fmt::format("{} is missing: {}", param.name, param.doc));
        if (!param.fallback.is_nil()) param.assign(param, op.fields(), param.fallback);
    }
}

Plan::Plan(const Graph& graph, const PlanOptions& options)
{
    if (graph.outputs.empty())
        throw Error("the graph returns no output; end the file with `return` and a node").at({graph.file, 0});

    // The nodes reached from the outputs, in the order in which they were made: inputs come first.
    std::map<std::uint64_t, NodePtr> reached;
    std::vector<NodePtr> open;
    for (const auto& [name, node] : graph.outputs) open.push_back(node);
    while (!open.empty()) {
        const NodePtr node = open.back();
        open.pop_back();
        if (!reached.emplace(node->serial, node).second) continue;
        open.insert(open.end(), node->inputs.begin(), node->inputs.end());
    }

    std::map<std::uint64_t, std::size_t> place;
    std::map<std::string, const Node*> by_name;
    for (const auto& [serial, node] : reached) {
        at_node(*node, [&, &made = node] {
            if (const auto [other, fresh] = by_name.emplace(made->name, made.get()); !fresh)
                throw Error(fmt::format("the name is taken by the node at line {}; give each its own",
                                        other->second->location.line));
        });
        PlannedNode planned{node, node->type->make(), {}, 0, 0, false, false};
        for (const NodePtr& input : node->inputs) {
            planned.inputs.push_back(place.at(input->serial));
            ++nodes[planned.inputs.back()].consumers;
        }
        place[serial] = nodes.size();
        nodes.push_back(std::move(planned));
    }
    for (const auto& [name, node] : graph.outputs) {
        outputs[name] = place.at(node->serial);
        ++nodes[place.at(node->serial)].consumers;
    }

    for (const NodePtr& node : graph.nodes)
        if (!reached.count(node->serial) && node->type->name == "write")
            warnings.push_back(
                fmt::format("{}:{}: node \"{}\": writes nothing: no output comes from it; return it, or go on from it",
                            node->location.file, node->location.line, node->name));

    find_simulations();
    for (PlannedSimulation& simulation : simulations)
        if (options.seed) simulation.seed = *options.seed;

    for (const PlannedNode& planned : nodes)
        at_node(*planned.node, [&] {
            const PlannedSimulation& simulation = simulations[planned.simulation];
            const Frame start{static_cast<double>(simulation.start), 0, 1 / simulation.fps};
            bind_arguments(*planned.node, *planned.op, start, false);
            planned.op->check();
        });

    for (PlannedNode& planned : nodes) {
        planned.once = !planned.in_loop && !planned.node->type->varies && !has_varying_argument(*planned.node) &&
                       std::all_of(planned.inputs.begin(), planned.inputs.end(),
                                   [&](std::size_t input) { return nodes[input].once; });
    }
    check_names(options);
}

// A node belongs to the simulation of its first input. Each Create starts one; the Solve that it reaches feeds it back.
void Plan::find_simulations()
{
    std::vector<std::set<std::size_t>> creates(nodes.size());  // simulations upstream of each node
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        PlannedNode& planned = nodes[i];
        const Node& node = *planned.node;
        if (node.type->kind == NodeKind::Source) {
            PlannedSimulation simulation;
            simulation.create = planned.node;
            at_node(node, [&] { bind_arguments(node, *planned.op, {}, false); });
            simulation.fps = constant_argument(node, "fps");
            simulation.start = static_cast<std::int64_t>(constant_argument(node, "start"));
            simulation.seed = static_cast<std::uint64_t>(constant_argument(node, "seed"));
            planned.simulation = simulations.size();
            creates[i].insert(simulations.size());
            simulations.push_back(simulation);
            continue;
        }
        planned.simulation = nodes[planned.inputs.front()].simulation;
        for (const std::size_t input : planned.inputs) creates[i].insert(creates[input].begin(), creates[input].end());
        if (node.type->kind == NodeKind::Solve) {
            for (const std::size_t s : creates[i]) {
                if (simulations[s].solve) {
                    const Node& other = *simulations[s].solve;
                    throw Error(
                        fmt::format("a second solve after \"{}\": \"{}\" at line {} feeds it back already; a create "
                                    "has one solve",
                                    simulations[s].create->name, other.name, other.location.line))
                        .in_node(node.name)
                        .at(node.location);
                }
                simulations[s].solve = planned.node;
            }
        }
    }

    // In the loop: downstream of a Create and upstream of its Solve.
    std::set<std::size_t> upstream;
    for (std::size_t i = nodes.size(); i-- > 0;) {
        const bool is_solve = nodes[i].node->type->kind == NodeKind::Solve;
        if (!is_solve && !upstream.count(i)) continue;
        nodes[i].in_loop = true;
        upstream.insert(nodes[i].inputs.begin(), nodes[i].inputs.end());
    }
}

void Plan::check_names(const PlanOptions& options)
{
    known_names_.assign(simulations.size(), {});
    struct Maker {
        AttributeSpec spec;
        std::size_t node;
    };
    const std::vector<std::string> always = {"P", "v", "id", "dt"};

    for (std::size_t s = 0; s < simulations.size(); ++s) {
        std::map<std::string, Maker> makers;
        std::set<std::string> groups;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            if (nodes[i].simulation != s) continue;
            at_node(*nodes[i].node, [&] {
                const Uses uses = uses_of(nodes[i]);
                groups.insert(uses.makes_groups.begin(), uses.makes_groups.end());
                for (const AttributeSpec& spec : uses.makes) {
                    const auto [other, fresh] = makers.emplace(spec.name, Maker{spec, i});
                    if (!fresh && type_of(other->second.spec.fallback) != type_of(spec.fallback))
                        throw Error(fmt::format(
                            "makes attribute \"{}\" as {}, but node \"{}\" at line {} makes it as {}", spec.name,
                            type_name(type_of(spec.fallback)), nodes[other->second.node].node->name,
                            nodes[other->second.node].node->location.line,
                            type_name(type_of(other->second.spec.fallback))));
                }
            });
        }

        std::set<std::string> asked(options.attributes.begin(), options.attributes.end());
        std::vector<std::string> names = always;
        for (const auto& [name, maker] : makers) names.push_back(name);
        for (const AttributeSpec& known : known_attributes()) names.push_back(known.name);
        const std::vector<std::string> group_names(groups.begin(), groups.end());

        for (const PlannedNode& planned : nodes) {
            // A merge's other inputs carry names of their own simulations: only the points of this one are checked
            // here.
            if (planned.simulation != s) continue;
            at_node(*planned.node, [&] {
                const Uses uses = uses_of(planned);
                for (const auto* list : {&uses.reads, &uses.writes}) {
                    for (const std::string& name : *list) {
                        if (std::find(always.begin(), always.end(), name) != always.end() || makers.count(name))
                            continue;
                        if (known_attribute(name)) {
                            asked.insert(name);
                            continue;
                        }
                        if (planned.node->type->kind == NodeKind::Merge || brings_other_points(planned)) continue;
                        const std::string near = nearest_name(name, names);
                        throw Error(
                            near.empty()
                                ? fmt::format("no attribute \"{0}\"; add :attribute{{ {0} = 0 }} before it", name)
                                : fmt::format("no attribute \"{0}\"; did you mean \"{1}\"? (or add :attribute{{ "
                                              "{0} = 0 }} before it)",
                                              name, near));
                    }
                }
                for (const std::string& name : uses.may)
                    if (known_attribute(name)) asked.insert(name);
                for (const std::string& name : uses.reads_groups)
                    if (!groups.count(name) && !brings_other_points(planned))
                        throw Error(
                            fmt::format("no node makes a group \"{}\"{}", name, did_you_mean(name, group_names)));
            });
        }
        if (makers.count("life") || asked.count("life")) asked.insert("age");  // Solve compares them
        for (const std::string& name : asked)
            if (known_attribute(name) && !makers.count(name)) known_names_[s].push_back(name);
    }
}

// Whether points of another simulation flow into this node: their columns are not known here.
bool Plan::brings_other_points(const PlannedNode& planned) const
{
    for (const std::size_t input : planned.inputs) {
        if (nodes[input].simulation != planned.simulation || brings_other_points(nodes[input])) return true;
    }
    return false;
}

std::vector<AttributeSpec> Plan::columns_of(std::size_t simulation) const
{
    std::vector<AttributeSpec> columns;
    std::map<std::string, AttributeValue> defaults;  // the first node that gives one decides
    std::set<std::string> taken;
    for (const PlannedNode& planned : nodes) {
        if (planned.simulation != simulation) continue;
        const bool makes_columns = planned.in_loop || planned.node->type->kind == NodeKind::Source;
        if (!makes_columns) continue;
        const Uses uses = uses_of(planned);
        for (const AttributeSpec& spec : uses.defaults) defaults.emplace(spec.name, spec.fallback);
        for (const AttributeSpec& spec : uses.makes)
            if (taken.insert(spec.name).second) columns.push_back(spec);
    }
    for (AttributeSpec& spec : columns)
        if (const auto given = defaults.find(spec.name); given != defaults.end()) spec.fallback = given->second;
    for (const std::string& name : known_names_[simulation])
        if (taken.insert(name).second) columns.push_back(*known_attribute(name));
    return columns;
}

std::vector<std::string> Plan::groups_of(std::size_t simulation) const
{
    std::set<std::string> groups;
    for (const PlannedNode& planned : nodes) {
        if (planned.simulation != simulation || !planned.in_loop) continue;
        const Uses uses = uses_of(planned);
        groups.insert(uses.makes_groups.begin(), uses.makes_groups.end());
    }
    return {groups.begin(), groups.end()};
}

std::int64_t Plan::first_frame() const
{
    std::int64_t first = simulations.front().start;
    for (const PlannedSimulation& simulation : simulations) first = std::min(first, simulation.start);
    return first;
}

}  // namespace rapid

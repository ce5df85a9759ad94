#include "runtime/graph/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "runtime/at_node.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/registry.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

// An argument that is never a function, or the parameter's default.
double constant_argument(const Node& node, std::string_view param)
{
    const auto given = node.arguments.find(std::string(param));
    const Value& value = given == node.arguments.end() ? node.type->find(param)->fallback : given->second;
    const double* number = value.get<double>();
    return number ? *number : 0;
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

// The name of one; empty where none is another at each frame.
std::string varying_argument(const Node& node)
{
    const auto found = std::find_if(node.arguments.begin(), node.arguments.end(),
                                    [](const auto& argument) { return varies(argument.second); });
    return found == node.arguments.end() ? std::string() : found->first;
}

// Asks a function of the frame. An Error of it tells the frame.
void assign_at(const Param& param, Operator& op, const FrameFunction& function, const Frame& frame)
{
    try {
        const Value result = function.call(frame);
        if (result.is_nil() && !param.may_be_nil) wrong_type(param, result);
        if (result.function()) throw Error(fmt::format("{} is a function that returned a function", param.name));
        param.assign(param, op.fields(), result);
    } catch (const Error& error) {
        Error placed(fmt::format("{} (frame {})", error.message(), frame.number));
        placed.at(error.location()).with_trace(error.trace());
        throw placed;
    }
}

void add(std::vector<std::size_t>& places, std::size_t place)
{
    if (places.empty() || places.back() != place) places.push_back(place);
}

}  // namespace

Uses uses_of(const PlannedNode& planned)
{
    Uses uses = planned.node->type->uses;
    for (const auto& [name, value] : planned.node->arguments)
        if (value.function()) uses.functions.insert(name);
    planned.op->uses(uses);
    for (const auto& [name, value] : planned.node->arguments)
        if (const auto* reference = value.get<AttributeRef>()) uses.reads.push_back(reference->name);
    return uses;
}

std::size_t PlannedAttribute::bytes_per_point() const
{
    if (group) return 1;
    return std::visit([](const auto& value) { return sizeof(value); }, spec.fallback);
}

const PlannedAttribute* PlannedSimulation::find(std::string_view name) const
{
    const auto found =
        std::find_if(attributes.begin(), attributes.end(), [&](const PlannedAttribute& a) { return a.name == name; });
    return found == attributes.end() ? nullptr : &*found;
}

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
        name_errors(node->name, node->location, [&, &made = node] {
            if (const auto [other, fresh] = by_name.emplace(made->name, made.get()); !fresh)
                throw Error(fmt::format("the name is taken by the node at line {}; give each its own",
                                        other->second->location.line));
        });
        PlannedNode planned;
        planned.node = node;
        planned.op = node->type->make();
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
        nodes[place.at(node->serial)].reached_from.insert(name);
    }
    for (std::size_t i = nodes.size(); i-- > 0;)
        for (const std::size_t input : nodes[i].inputs)
            nodes[input].reached_from.insert(nodes[i].reached_from.begin(), nodes[i].reached_from.end());

    for (const NodePtr& node : graph.nodes)
        if (!reached.count(node->serial)) left_out.push_back(node);
    for (const NodePtr& node : left_out)
        if (node->type->name == "write")
            warnings.push_back(
                fmt::format("{}:{}: node \"{}\": writes nothing: no output comes from it; return it, or go on from it",
                            node->location.file, node->location.line, node->name));

    find_simulations();
    for (PlannedSimulation& simulation : simulations)
        if (options.seed) simulation.seed = *options.seed;

    for (const PlannedNode& planned : nodes)
        name_errors(planned.node->name, planned.node->location, [&] {
            const PlannedSimulation& simulation = simulations[planned.simulation];
            const Frame start =
                FrameClock{simulation.fps, simulation.start, simulation.subframes}.at_step(simulation.start);
            bind_arguments(*planned.node, *planned.op, start, false);
            planned.op->check();
        });

    keeps_all = options.keep_all;
    find_changes();
    check_names();
    for (std::size_t s = 0; s < simulations.size(); ++s) find_attributes(s, options);
}

void Plan::find_changes()
{
    for (PlannedNode& planned : nodes) {
        const std::string argument = varying_argument(*planned.node);
        if (planned.in_loop)
            planned.changes = "its points are fed back from frame to frame";
        else if (!argument.empty())
            planned.changes = fmt::format("its {} changes with the frame", argument);
        else if (planned.node->type->varies)
            planned.changes = "its result may be another one in each frame";
        else
            for (const std::size_t input : planned.inputs)
                if (planned.changes.empty() && !nodes[input].once)
                    planned.changes = fmt::format("\"{}\" before it is evaluated anew", nodes[input].node->name);
        if (keeps_all && planned.changes.empty()) planned.changes = "nothing is left out";
        planned.once = planned.changes.empty();
    }
}

// A node belongs to the simulation of its first input. Each Create starts one; the Solve that it reaches feeds it back.
void Plan::find_simulations()
{
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        PlannedNode& planned = nodes[i];
        const Node& node = *planned.node;
        if (node.type->kind == NodeKind::Source) {
            PlannedSimulation simulation;
            simulation.create = planned.node;
            name_errors(node.name, node.location, [&] { bind_arguments(node, *planned.op, {}, false); });
            simulation.fps = constant_argument(node, "fps");
            simulation.start = static_cast<std::int64_t>(constant_argument(node, "start"));
            simulation.subframes = static_cast<int>(constant_argument(node, "subframes"));
            simulation.seed = static_cast<std::uint64_t>(constant_argument(node, "seed"));
            if (!simulations.empty() && simulations.front().subframes != simulation.subframes)
                throw Error(fmt::format("subframes = {}, and {} at \"{}\"; all simulations of a graph have the same",
                                        simulation.subframes, simulations.front().subframes,
                                        simulations.front().create->name))
                    .in_node(node.name)
                    .at(node.location);
            planned.simulation = simulations.size();
            planned.carries.insert(simulations.size());
            simulations.push_back(simulation);
            continue;
        }
        planned.simulation = nodes[planned.inputs.front()].simulation;
        for (const std::size_t input : planned.inputs)
            planned.carries.insert(nodes[input].carries.begin(), nodes[input].carries.end());
        if (node.type->kind == NodeKind::Solve) {
            for (const std::size_t s : planned.carries) {
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

void Plan::check_names() const
{
    struct Maker {
        AttributeSpec spec;
        std::size_t node;
    };
    for (std::size_t s = 0; s < simulations.size(); ++s) {
        std::map<std::string, Maker> makers;
        std::set<std::string> groups;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            if (nodes[i].simulation != s) continue;
            name_errors(nodes[i].node->name, nodes[i].node->location, [&] {
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

        std::vector<std::string> names = point_names_of(PointName::OwnColumn);
        for (const auto& [name, maker] : makers) names.push_back(name);
        for (const AttributeSpec& known : known_attributes()) names.push_back(known.name);
        const std::vector<std::string> group_names(groups.begin(), groups.end());

        for (const PlannedNode& planned : nodes) {
            // A merge's other inputs carry names of their own simulations: only the points of this one are checked
            // here.
            if (planned.simulation != s) continue;
            const bool brings_others = planned.carries.size() > 1;
            name_errors(planned.node->name, planned.node->location, [&] {
                const Uses uses = uses_of(planned);
                for (const auto* list : {&uses.reads, &uses.writes}) {
                    for (const std::string& name : *list) {
                        if (is_own_column(name) || makers.count(name) || known_attribute(name) || brings_others)
                            continue;
                        const std::string near = nearest_name(name, names);
                        throw Error(
                            near.empty()
                                ? fmt::format("no attribute \"{0}\"; add :attribute{{ {0} = 0 }} before it", name)
                                : fmt::format("no attribute \"{0}\"; did you mean \"{1}\"? (or add :attribute{{ "
                                              "{0} = 0 }} before it)",
                                              name, near));
                    }
                }
                for (const std::string& name : uses.reads_groups)
                    if (!groups.count(name) && !brings_others)
                        throw Error(
                            fmt::format("no node makes a group \"{}\"{}", name, did_you_mean(name, group_names)));
            });
        }
    }
}

// Who makes, writes and reads each name that the points of a simulation may have; and, from that, what is kept. A node
// that makes a name makes it for the points of its simulation, which take it along where they are merged into another;
// a node reads it of all simulations whose points come by.
void Plan::find_attributes(std::size_t s, const PlanOptions& options)
{
    std::set<std::size_t> sources = {s};
    for (const PlannedNode& planned : nodes)
        if (planned.simulation == s) sources.insert(planned.carries.begin(), planned.carries.end());

    std::map<std::string, PlannedAttribute> found;
    const auto entry = [&](const AttributeSpec& spec) -> PlannedAttribute& {
        PlannedAttribute& attribute = found[spec.name];
        if (attribute.name.empty()) attribute.name = spec.name, attribute.spec = spec;
        return attribute;
    };
    const auto group_entry = [&](const std::string& name) -> PlannedAttribute& {
        PlannedAttribute& attribute = found[group_prefix + name];
        attribute.name = group_prefix + name;
        attribute.group = true;
        return attribute;
    };
    entry({"P", Vec3f(Vec3f::Zero())}).always = true;
    entry({"v", Vec3f(Vec3f::Zero())}).always = true;
    entry({"id", std::int64_t{0}}).always = true;
    entry({"dt", 0.0f});
    for (const AttributeSpec& known : known_attributes()) entry(known);

    // Read where something else makes them; given where something else reads them.
    std::map<std::string, std::vector<std::size_t>> takers, givers;
    std::vector<std::size_t> readers_of_all;
    std::vector<std::pair<std::size_t, Uses>> users;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const PlannedNode& planned = nodes[i];
        if (!planned.carries.count(s) && !sources.count(planned.simulation)) continue;
        const Uses& uses = users.emplace_back(i, uses_of(planned)).second;
        for (const AttributeSpec& spec : uses.makes) add(entry(spec).made_by, i);
        for (const std::string& name : uses.makes_groups) add(group_entry(name).made_by, i);
        for (const std::string& name : uses.joins_groups) add(group_entry(name).written_by, i);
    }
    for (const auto& [i, uses] : users) {
        for (const std::string& name : uses.writes)
            if (const auto at = found.find(name); at != found.end()) add(at->second.written_by, i);
        for (const std::string& name : uses.gives) add(givers[name], i);
        if (!nodes[i].carries.count(s)) continue;
        for (const auto* list : {&uses.reads, &uses.may})
            for (const std::string& name : *list)
                if (const auto at = found.find(name); at != found.end()) add(at->second.read_by, i);
        for (const auto* list : {&uses.reads_groups, &uses.takes_groups})
            for (const std::string& name : *list) add(takers[group_prefix + name], i);
        for (const std::string& name : uses.takes) add(takers[name], i);
        if (uses.reads_all) readers_of_all.push_back(i);
    }
    for (auto& [name, attribute] : found) {
        const bool given = givers.count(name) && takers.count(name);
        if (given) attribute.written_by.insert(attribute.written_by.end(), givers[name].begin(), givers[name].end());
        if (!attribute.is_of_scene()) continue;
        for (const std::size_t taker : takers[name]) add(attribute.read_by, taker);
        if (!attribute.made_by.empty())
            attribute.read_by.insert(attribute.read_by.end(), readers_of_all.begin(), readers_of_all.end());
    }
    // Solve compares them, where somebody's life may end.
    const PlannedAttribute& life = found.at("life");
    if (!life.made_by.empty() || !life.written_by.empty())
        for (const std::size_t reader : life.read_by) add(found.at("age").read_by, reader);

    PlannedSimulation& simulation = simulations[s];
    const std::set<std::string> asked(options.attributes.begin(), options.attributes.end());
    for (auto& [name, attribute] : found) {
        for (auto* places : {&attribute.made_by, &attribute.written_by, &attribute.read_by}) {
            std::sort(places->begin(), places->end());
            places->erase(std::unique(places->begin(), places->end()), places->end());
        }
        const std::string plain = attribute.group ? name.substr(group_prefix.size()) : name;
        attribute.asked_by_name = asked.count(plain) > 0 && name != "dt";
        attribute.asked_as_made = options.all_made && !attribute.made_by.empty();
        attribute.kept = attribute.always || !attribute.written_by.empty() || !attribute.read_by.empty() ||
                         attribute.asked_by_name || attribute.asked_as_made || (options.keep_all && name != "dt");
        if (!attribute.kept && name != "dt") simulation.left_out.insert(name);
        simulation.attributes.push_back(attribute);
    }
}

std::set<std::string> Plan::names_of_scene() const
{
    std::set<std::string> names;
    for (const PlannedSimulation& simulation : simulations)
        for (const PlannedAttribute& attribute : simulation.attributes)
            if (attribute.is_of_scene() && attribute.name != "dt")
                names.insert(attribute.group ? attribute.name.substr(group_prefix.size()) : attribute.name);
    return names;
}

std::size_t Plan::last_together(std::size_t first) const
{
    const PointEdit* edit = nodes[first].op->as_point_edit();
    bool removed = false;
    for (std::size_t last = first; edit; ++last) {
        removed |= edit->removes_points();
        if (last + 1 == nodes.size() || nodes[last + 1].inputs != std::vector{last}) return last;
        const PlannedNode &before = nodes[last], &after = nodes[last + 1];
        edit = after.op->as_point_edit();
        if (!edit || (removed && edit->asks_places())) return last;
        if (before.consumers > 1 || before.in_loop != after.in_loop || before.once || after.once) return last;
    }
    return first;
}

std::vector<std::vector<std::size_t>> Plan::passes() const
{
    std::vector<std::vector<std::size_t>> passes;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const NodeKind kind = nodes[i].node->type->kind;
        if (kind == NodeKind::Source || kind == NodeKind::Dynamic) continue;
        std::set<std::size_t> pass = {i};
        for (const std::size_t last = last_together(i); i < last;) pass.insert(++i);
        if (kind == NodeKind::Solve) {
            std::vector<std::size_t> open = nodes[i].inputs;
            std::set<std::size_t> seen;
            while (!open.empty()) {
                const std::size_t at = open.back();
                open.pop_back();
                if (nodes[at].node->type->kind == NodeKind::Solve || !seen.insert(at).second) continue;
                if (nodes[at].node->type->kind == NodeKind::Dynamic) pass.insert(at);
                open.insert(open.end(), nodes[at].inputs.begin(), nodes[at].inputs.end());
            }
        }
        passes.emplace_back(pass.begin(), pass.end());
    }
    return passes;
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
    const auto made_here = [&](const PlannedAttribute& attribute) {
        return std::any_of(attribute.made_by.begin(), attribute.made_by.end(),
                           [&](std::size_t maker) { return nodes[maker].simulation == simulation; });
    };
    for (const PlannedAttribute& attribute : simulations[simulation].attributes)
        if (attribute.kept && known_attribute(attribute.name) && !made_here(attribute))
            columns.push_back(*known_attribute(attribute.name));
    std::erase_if(columns,
                  [&](const AttributeSpec& spec) { return simulations[simulation].left_out.count(spec.name) > 0; });
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
    std::erase_if(groups, [&](const std::string& name) {
        return simulations[simulation].left_out.count(group_prefix + name) > 0;
    });
    return {groups.begin(), groups.end()};
}

std::int64_t Plan::first_frame() const
{
    std::int64_t first = simulations.front().start;
    for (const PlannedSimulation& simulation : simulations) first = std::min(first, simulation.start);
    return first;
}

}  // namespace rapid

#include "runtime/graph/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "runtime/base/at_node.h"
#include "runtime/graph/arguments.h"
#include "runtime/graph/attribute_uses.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/points_object.h"
#include "runtime/points/attribute_like.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/collision/hits.h"

namespace rapid {
namespace {

// Warnings about graphs that are legal but probably not intended.

std::string warning_of(const Node& node, const std::string& text)
{
    return fmt::format("{}:{}: node \"{}\": {}", node.location.file, node.location.line, node.name, text);
}

bool names(const std::vector<std::string>& list, std::string_view name)
{
    return std::find(list.begin(), list.end(), name) != list.end();
}

bool is_provided(const PlannedSimulation& simulation, std::string_view name)
{
    const PlannedAttribute* attribute = simulation.find(name);
    return attribute && (!attribute->made_by.empty() || !attribute->written_by.empty());
}

bool is_provided_to(const Plan& plan, const PlannedNode& reader, std::string_view name)
{
    return std::any_of(reader.carries.begin(), reader.carries.end(),
                       [&](std::size_t simulation) { return is_provided(plan.simulations[simulation], name); });
}

// Warns of nodes whose result is unused. Chains that are unused as a whole, or end in a Solve, are assumed to be
// intended.
void warn_of_dropped_nodes(const Graph& graph, const Plan& plan, std::vector<std::string>& warnings)
{
    std::set<const Node*> taken, reached;
    for (const NodePtr& node : graph.nodes) {
        for (const NodePtr& input : node->inputs) taken.insert(input.get());
        for (const auto& [name, value] : node->arguments)
            if (const auto source = value.object<NodeHandle>()) taken.insert(source->node.get());
    }
    for (const PlannedNode& planned : plan.nodes) reached.insert(planned.node.get());
    for (const NodePtr& node : plan.pruned) {
        const std::string& type = node->type->name;
        const bool ends = node->type->kind == NodeKind::Solve || node->inputs.empty();
        const bool is_reported = type == "write" || type == "rasterize";  // by the plan
        if (ends || is_reported || taken.count(node.get()) || !reached.count(node->inputs.front().get())) continue;
        warnings.push_back(warning_of(
            *node,
            fmt::format("leads to no output, because its result is not used; assign it: chain = chain:{} {{ ... }}",
                        type)));
    }
}

// Warns of scripts that relate age to life in chains without lives.
void warn_of_missing_lives(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedNode& planned : plan.nodes) {
        const auto& arguments = planned.node->arguments;
        const auto is_script = [](const auto& argument) { return argument.second.template object<PointFunction>(); };
        if (std::none_of(arguments.begin(), arguments.end(), is_script)) continue;
        const std::vector<std::string> reads = uses_of(planned).reads;
        if (!names(reads, "age") || !names(reads, "life") || is_provided_to(plan, planned, "life")) continue;
        warnings.push_back(
            warning_of(*planned.node, "needs the life of its points, but they live for ever; give emit a life"));
    }
}

// Warns of forces after a goal that holds its points, which no force can move.
void warn_of_held_points(const Plan& plan, std::vector<std::string>& warnings)
{
    std::map<std::size_t, const Node*> goals;  // by simulation; null once warned
    const auto given = [](const Node& node, const char* param) {
        const auto found = node.arguments.find(param);
        return found == node.arguments.end() ? nullptr : &found->second;
    };
    for (const PlannedNode& planned : plan.nodes) {
        const Node& node = *planned.node;
        if (!planned.in_loop || given(node, "group")) continue;
        const Value* hold = given(node, "hold");
        const bool holds = !hold || (hold->get<bool>() && *hold->get<bool>());
        if (node.type->name == "goal" && holds) {
            goals.emplace(planned.simulation, &node);
        } else if (const auto goal = goals.find(planned.simulation);
                   goal != goals.end() && goal->second && node.type->has(Stage::Forces)) {
            warnings.push_back(
                warning_of(node, fmt::format("can't move the points that have arrived, because {} holds them; to let "
                                             "them go, give {} hold = false",
                                             goal->second->name, goal->second->name)));
            goal->second = nullptr;
        }
    }
}

// Returns the value that a node gives to an attribute of points; null if it gives none.
const Value* given_attribute(const Node& node, const std::string& name)
{
    const auto in = [&](const std::map<std::string, Value>& values) {
        const auto found = values.find(name);
        return found == values.end() ? nullptr : &found->second;
    };
    if (node.type->rest) return in(node.arguments);
    const auto attributes = node.arguments.find("attributes");
    const Table* table = attributes == node.arguments.end() ? nullptr : attributes->second.table();
    return table ? in(table->named) : nullptr;
}

// Returns the numbers in a constant value.
std::vector<double> numbers_in(const Value& value)
{
    if (const double* number = value.get<double>()) return {*number};
    if (const Vec3d* vector = value.get<Vec3d>()) return {vector->begin(), vector->end()};
    std::vector<double> numbers;
    if (const Table* table = value.table())
        for (const Value& entry : table->list)
            for (const double number : numbers_in(entry)) numbers.push_back(number);
    return numbers;
}

// Returns the diagonal of the shape on which points are born, m; infinity for a plane, a few metres for other sources.
double size_of_source(const Node& node)
{
    constexpr double usual = 3;
    const auto source = node.arguments.find("source");
    const auto shape = source == node.arguments.end() ? nullptr : source->second.object<Shape>();
    return shape ? shape->bounds().sizes().norm() : usual;
}

// Warns of values that are legal but suggest another unit.
void warn_of_units(const Plan& plan, std::vector<std::string>& warnings)
{
    constexpr double brightest = 30;  // of linear light: fires and lamps stay below it
    for (const PlannedNode& planned : plan.nodes) {
        const Node& node = *planned.node;
        const auto warn = [&](const std::string& text) { warnings.push_back(warning_of(node, text)); };
        if (const Value* Cd = given_attribute(node, "Cd"))
            if (const auto all = numbers_in(*Cd);
                std::any_of(all.begin(), all.end(), [](double c) { return c > brightest; }))
                warn(fmt::format("Cd = {}: colours go from 0 to 1; divide by 255", describe(*Cd)));
        if (const Value* pscale = given_attribute(node, "pscale"))
            if (const auto all = numbers_in(*pscale); !all.empty()) {
                const double least = *std::min_element(all.begin(), all.end());
                if (least >= 1 && least > size_of_source(node))
                    warn(fmt::format("pscale = {} is a radius in metres, larger than the source; give a smaller one",
                                     describe(*pscale)));
            }
        if (node.type->name == "fade_by_age" && !node.arguments.count("first")) {
            const auto attribute = node.arguments.find("attribute");
            const std::string* name =
                attribute == node.arguments.end() ? nullptr : attribute->second.get<std::string>();
            if (!name || *name == "pscale")
                warn("sets pscale to 1 at birth, which is a radius of 1 m; give first, such as first = 0.02");
        }
        const auto life = node.arguments.find("life");
        if (life == node.arguments.end() || !node.type->has(Stage::Emission)) continue;
        const double fps = plan.simulations[planned.simulation].fps;
        constexpr double frames_of_a_shot = 1000;
        const std::vector<double> all = numbers_in(life->second);
        if (!all.empty() && all.front() >= fps && all.back() <= frames_of_a_shot)
            warn(
                fmt::format("life = {} is in seconds; if frames are meant, divide by {}", describe(life->second), fps));
    }
}

// Returns true for a range of two opposite vectors with several components, such as {{-5, -5, -5}, {5, 5, 5}}.
bool is_opposite_range(const Value& value)
{
    const Table* table = value.table();
    if (!table || table->list.size() != 2) return false;
    const std::vector<double> low = numbers_in(table->list[0]), high = numbers_in(table->list[1]);
    if (low.size() != 3 || high.size() != 3) return false;
    int components = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        if (low[k] != -high[k]) return false;
        components += low[k] != 0;
    }
    return components > 1;
}

// Warns of ranges of angular velocities that look like a box of vectors but are a line.
void warn_of_common_axes(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedNode& planned : plan.nodes)
        if (const Value* w = given_attribute(*planned.node, "w"); w && is_opposite_range(*w))
            warnings.push_back(
                warning_of(*planned.node,
                           fmt::format("w = {} turns all points about one axis, because values are drawn on the "
                                       "line between the two vectors; leave w out and use :tumble {{ speed = 360 }}, "
                                       "or set p.w in birth = function(p) ... end",
                                       describe(*w))));
}

// Warns of attributes under names that other programs use, which nothing reads.
void warn_of_other_names(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedSimulation& simulation : plan.simulations)
        for (const PlannedAttribute& attribute : simulation.attributes) {
            const std::string_view known = name_of_synonym(attribute.name);
            const bool is_used =
                !attribute.read_by.empty() || !attribute.written_by.empty() || attribute.requested_by_name;
            if (known.empty() || attribute.made_by.empty() || is_used) continue;
            const Node& maker = *plan.nodes[attribute.made_by.front()].node;
            if (given_attribute(maker, attribute.name))
                warnings.push_back(
                    warning_of(maker, fmt::format("gives points \"{}\", which nothing reads; the {} of points is {}",
                                                  attribute.name, attribute.name, known)));
        }
}

// Warns of nodes :tumble in chains whose points have no angular velocity.
void warn_of_still_tumbles(const Plan& plan, std::vector<std::string>& warnings)
{
    const auto turns = [&](const std::vector<std::size_t>& nodes) {
        return std::any_of(nodes.begin(), nodes.end(),
                           [&](std::size_t node) { return plan.nodes[node].node->type->name != "tumble"; });
    };
    for (const PlannedNode& planned : plan.nodes) {
        if (planned.node->type->name != "tumble" || planned.node->arguments.count("speed")) continue;
        if (std::none_of(planned.carries.begin(), planned.carries.end(), [&](std::size_t s) {
                const PlannedAttribute* w = plan.simulations[s].find("w");
                return w && (turns(w->made_by) || turns(w->written_by));
            }))
            warnings.push_back(
                warning_of(*planned.node,
                           "turns nothing, because the angular velocity w of all points is 0; give it a speed in "
                           "degrees per second: :tumble { speed = 360 }"));
    }
}

// Warns of angular velocities that have no effect.
void warn_of_idle_spins(const Plan& plan, std::vector<std::string>& warnings)
{
    for (const PlannedSimulation& simulation : plan.simulations) {
        const PlannedAttribute* w = simulation.find("w");
        if (!w || w->made_by.empty() || !w->read_by.empty()) continue;
        warnings.push_back(
            warning_of(*plan.nodes[w->made_by.front()].node,
                       "makes w, but no node turns points by it; add :tumble {}, or give :contact spin = true"));
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

// Warns of kernels that assign P in chains in which nothing gives points a velocity.
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
                       "moves P but leaves v at 0, so files and motion blur have no velocities; instead of p.P assign "
                       "p.v = (position - p.P) / frame.dt, and :solve moves the point there"));
    }
}

// Returns the first frame of the scene.
double start_of(const Plan& plan)
{
    double start = std::numeric_limits<double>::infinity();
    for (const PlannedNode& planned : plan.nodes) {
        if (planned.node->type->kind != NodeKind::Source) continue;
        const auto given = planned.node->arguments.find("start");
        const double* frame = given == planned.node->arguments.end() ? nullptr : given->second.get<double>();
        start = std::min(start, frame ? *frame : 1.0);
    }
    return start;
}

// Warns of mesh files that begin later after the scene than they last, and are probably meant to begin with it.
void warn_of_late_sequences(const Plan& plan, std::vector<std::string>& warnings)
{
    const double start = start_of(plan);
    for (const PlannedNode& planned : plan.nodes)
        for (const auto& [name, value] : planned.node->arguments) {
            const auto mesh = value.object<AnimatedMesh>();
            if (!mesh || !mesh->deforms()) continue;
            const FrameRange files = mesh->range();
            if (files.empty() || !(files.first - start > files.last - files.first)) continue;
            warnings.push_back(warning_of(
                *planned.node,
                fmt::format(
                    "the files of its {} begin at frame {}, and the scene at frame {}; until then the first one "
                    "stands still: give rapid.mesh.read offset = {}, or rapid.create start = {}",
                    name, files.first, start, start - files.first, files.first)));
        }
}

// Returns warnings, with advice, about nodes whose result is dropped, that wait for something that never comes, or
// that make something unused. plan: the plan of the graph, after its attributes are found.
std::vector<std::string> warnings_about(const Graph& graph, const Plan& plan)
{
    std::vector<std::string> warnings;
    warn_of_dropped_nodes(graph, plan, warnings);
    warn_of_missing_lives(plan, warnings);
    warn_of_idle_spins(plan, warnings);
    warn_of_common_axes(plan, warnings);
    warn_of_still_tumbles(plan, warnings);
    warn_of_held_points(plan, warnings);
    warn_of_other_names(plan, warnings);
    warn_of_units(plan, warnings);
    warn_of_moves_without_velocity(plan, warnings);
    warn_of_late_sequences(plan, warnings);
    return warnings;
}

}  // namespace

Uses uses_of(const PlannedNode& planned)
{
    Uses uses = planned.node->type->uses;
    for (const auto& [name, value] : planned.node->arguments)
        if (value.function()) uses.functions.insert(name);
    uses.source_makes = planned.source_makes;
    name_errors(planned.node->name, planned.node->location, [&] { planned.op->uses(uses); });
    std::vector<std::string>& references = planned.sources.empty() ? uses.reads : uses.reads_of_source;
    for (const auto& [name, value] : planned.node->arguments)
        if (const auto* reference = value.get<AttributeRef>()) references.push_back(reference->name);
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

namespace {

// Returns the node in the argument `from`. A node in another argument has the wrong type.
std::vector<NodePtr> sources_of(const Node& node)
{
    const Param* from = node.type->find("from");
    const auto given = node.arguments.find("from");
    if (!from || from->type != NodeHandle::param_type || given == node.arguments.end()) return {};
    const auto handle = given->second.object<NodeHandle>();
    return handle ? std::vector{handle->node} : std::vector<NodePtr>();
}

// Returns warnings about nodes that read hit attributes of points for which no collider writes them.
std::set<std::string> reads_of_no_hits(const std::vector<PlannedNode>& nodes,
                                       const std::vector<PlannedSimulation>& simulations)
{
    std::set<std::string> warnings;
    for (std::size_t s = 0; s < simulations.size(); ++s)
        for (const char* name : Hits::names) {
            const PlannedAttribute& hit = *simulations[s].find(name);
            if (hit.read_by.empty() || is_provided(simulations[s], name)) continue;
            const PlannedNode& reader = nodes[hit.read_by.front()];
            const bool comes_elsewhere =
                std::any_of(reader.carries.begin(), reader.carries.end(),
                            [&](std::size_t other) { return is_provided(simulations[other], name); });
            if (comes_elsewhere) continue;
            warnings.insert(
                fmt::format("{}:{}: node \"{}\": reads {}, which no collider writes; give :collide record = true",
                            reader.node->location.file, reader.node->location.line, reader.node->name, name));
            break;
        }
    return warnings;
}

// Throws Error if a node writes numbers to an attribute that is not a number.
void check_number_attributes(const Plan& plan)
{
    for (const PlannedNode& planned : plan.nodes)
        for (const Param& param : planned.node->type->params) {
            if (param.type != number_attribute_type) continue;
            const auto given = planned.node->arguments.find(param.name);
            const Value& value = given == planned.node->arguments.end() ? param.fallback : given->second;
            const PlannedAttribute* attribute = plan.simulations[planned.simulation].find(*value.get<std::string>());
            if (!attribute || attribute->group) continue;
            const AttributeType type = type_of(attribute->spec.fallback);
            if (type == AttributeType::Float || type == AttributeType::Int32 || type == AttributeType::Int64) continue;
            name_errors(planned.node->name, planned.node->location, [&] {
                throw Error(fmt::format("{} = \"{}\" is a {}; it must be an attribute with one number per point",
                                        param.name, attribute->name, type_name(type)));
            });
        }
}

}  // namespace

Plan::Plan(const Graph& graph, const PlanOptions& options)
    : keeps_all(options.keep_all), keeps_steps(options.keep_steps)
{
    if (graph.outputs.empty())
        throw Error("the graph returns no output; end the file with `return` and a node").at({graph.file, 0});
    collect_nodes(graph);
    find_simulations();
    find_steps();
    for (PlannedSimulation& simulation : simulations) simulation.recorded |= keeps_steps && simulation.solve;
    if (options.seed)
        for (PlannedSimulation& simulation : simulations) simulation.seed = *options.seed;
    bind_all();
    // points.events of :detail is the record of the last step; a function names it in its text.
    for (const PlannedNode& planned : nodes) {
        const std::vector<std::string> named = uses_of(planned).may;
        PlannedSimulation& simulation = simulations[planned.simulation];
        simulation.recorded |= simulation.solve && std::find(named.begin(), named.end(), "events") != named.end();
    }
    find_changes();
    warn_of_idle_nodes();
    const AttributeFlow flow(nodes);
    for (std::size_t s = 0; s < simulations.size(); ++s) check_names(nodes, flow, s);
    for (std::size_t s = 0; s < simulations.size(); ++s)
        simulations[s].attributes = find_attributes(nodes, flow, s, options);
    check_number_attributes(*this);
    keep_for_merges(nodes, simulations);
    for (PlannedSimulation& simulation : simulations)
        for (const PlannedAttribute& attribute : simulation.attributes)
            if (!attribute.kept && attribute.name != "dt") simulation.pruned.insert(attribute.name);
    for (const std::string& warning : reads_of_no_hits(nodes, simulations)) warnings.push_back(warning);
    for (const std::string& warning : warnings_about(graph, *this)) warnings.push_back(warning);
}

// Collects the nodes reached from the outputs, in order of creation: inputs come first.
void Plan::collect_nodes(const Graph& graph)
{
    std::map<std::uint64_t, NodePtr> reached;
    std::vector<NodePtr> open;
    for (const auto& [name, node] : graph.outputs) open.push_back(node);
    while (!open.empty()) {
        const NodePtr node = open.back();
        open.pop_back();
        if (!reached.emplace(node->serial, node).second) continue;
        open.insert(open.end(), node->inputs.begin(), node->inputs.end());
        const std::vector<NodePtr> sources = sources_of(*node);
        open.insert(open.end(), sources.begin(), sources.end());
    }

    std::map<std::uint64_t, std::size_t> index;  // by serial
    std::map<std::string, const Node*> by_name;
    for (const auto& [serial, node] : reached) {
        name_errors(node->name, node->location, [&, &made = node] {
            if (const auto [other, fresh] = by_name.emplace(made->name, made.get()); !fresh)
                throw Error(fmt::format("the node at line {} has the same name; give each node a different name",
                                        other->second->location.line));
        });
        PlannedNode planned;
        planned.node = node;
        planned.op = node->type->make();
        for (const NodePtr& input : node->inputs) {
            planned.inputs.push_back(index.at(input->serial));
            ++nodes[planned.inputs.back()].consumers;
        }
        for (const NodePtr& source : sources_of(*node)) {
            planned.sources.push_back(index.at(source->serial));
            ++nodes[planned.sources.back()].consumers;
        }
        index[serial] = nodes.size();
        nodes.push_back(std::move(planned));
    }
    for (const auto& [name, node] : graph.outputs) {
        outputs[name] = index.at(node->serial);
        ++nodes[index.at(node->serial)].consumers;
        nodes[index.at(node->serial)].reached_from.insert(name);
    }
    for (std::size_t i = nodes.size(); i-- > 0;)
        for (const auto* list : {&nodes[i].inputs, &nodes[i].sources})
            for (const std::size_t input : *list)
                nodes[input].reached_from.insert(nodes[i].reached_from.begin(), nodes[i].reached_from.end());

    for (const NodePtr& node : graph.nodes) {
        if (reached.count(node->serial)) continue;
        pruned.push_back(node);
        if (node->type->name == "write" || node->type->name == "rasterize")
            warnings.push_back(
                fmt::format("{}:{}: node \"{}\": writes nothing, because it leads to no output; return it, or continue "
                            "the chain from it",
                            node->location.file, node->location.line, node->name));
    }
}

// Forces, colliders and constraints act only in a Solve, and only a Solve carries points from frame to frame. Adds one
// warning per simulation, about the first such node.
void Plan::warn_of_idle_nodes()
{
    std::set<std::size_t> reported;
    for (const PlannedNode& planned : nodes) {
        const Node& node = *planned.node;
        const bool is_dynamic = node.type->kind == NodeKind::Dynamic;
        if (planned.in_loop || (!is_dynamic && !node.type->has(Stage::Emission))) continue;
        if (!reported.insert(planned.simulation).second) continue;
        warnings.push_back(
            fmt::format("{}:{}: node \"{}\": {}, because no :solve comes after it; end the chain with :solve {{}}",
                        node.location.file, node.location.line, node.name,
                        is_dynamic ? "has no effect" : "its points exist only in the frame of their birth"));
    }
}

// A node belongs to the simulation of its first input, and carries the points of all its inputs.
void Plan::find_simulations()
{
    for (PlannedNode& planned : nodes) {
        if (planned.node->type->kind == NodeKind::Source) {
            start_simulation(planned);
            continue;
        }
        planned.simulation = nodes[planned.inputs.front()].simulation;
        for (const std::size_t input : planned.inputs)
            planned.carries.insert(nodes[input].carries.begin(), nodes[input].carries.end());
        if (planned.node->type->kind == NodeKind::Solve) feed_back(planned);
    }

    std::set<std::size_t> upstream;  // of a Solve
    for (std::size_t i = nodes.size(); i-- > 0;) {
        const bool is_solve = nodes[i].node->type->kind == NodeKind::Solve;
        if (!is_solve && !upstream.count(i)) continue;
        nodes[i].in_loop = true;
        upstream.insert(nodes[i].inputs.begin(), nodes[i].inputs.end());
    }
}

// A source that a node in a loop reads is evaluated as often as that loop.
void Plan::find_steps()
{
    for (std::size_t i = nodes.size(); i-- > 0;) {
        PlannedNode& planned = nodes[i];
        planned.in_steps |= planned.in_loop;
        if (!planned.in_steps) continue;
        for (const std::size_t source : planned.sources) nodes[source].in_steps = true;
        if (!planned.in_loop)
            for (const std::size_t input : planned.inputs) nodes[input].in_steps = true;
    }
    for (PlannedNode& planned : nodes)
        name_errors(planned.node->name, planned.node->location, [&] {
            for (const std::size_t s : planned.sources) check_source(planned, s);
        });
}

// Throws Error if the points have no path through a frame.
void Plan::check_source(const PlannedNode& planned, std::size_t s)
{
    const PlannedNode& source = nodes[s];
    PlannedSimulation& from = simulations[source.simulation];
    const std::string& name = source.node->name;
    if (!from.solve)
        throw Error(fmt::format("from = node \"{}\": no solve moves its points; end its chain with :solve {{}}", name));
    if (source.simulation != planned.simulation && source.in_loop && source.node->type->kind != NodeKind::Solve)
        throw Error(fmt::format("from = node \"{}\" comes before its solve; give \"{}\" or a node after it", name,
                                from.solve->name));
    if (from.fps != simulations[planned.simulation].fps)
        throw Error(
            fmt::format("from = node \"{}\" runs at {} frames per second and this chain at {}; give both the same fps",
                        name, from.fps, simulations[planned.simulation].fps));
    from.recorded = true;
}

void Plan::start_simulation(PlannedNode& create)
{
    const Node& node = *create.node;
    PlannedSimulation simulation;
    simulation.create = create.node;
    name_errors(node.name, node.location, [&] { bind_arguments(node, *create.op, {}, {}, false); });
    simulation.fps = constant_argument(node, "fps");
    simulation.start = static_cast<std::int64_t>(constant_argument(node, "start"));
    simulation.subframes = static_cast<int>(constant_argument(node, "subframes"));
    simulation.seed = static_cast<std::uint64_t>(constant_argument(node, "seed"));
    if (!simulations.empty() && simulations.front().subframes != simulation.subframes)
        throw Error(fmt::format("subframes = {}, but {} at \"{}\"; all simulations of a graph must have the same",
                                simulation.subframes, simulations.front().subframes, simulations.front().create->name))
            .in_node(node.name)
            .at(node.location);
    create.simulation = simulations.size();
    create.carries.insert(simulations.size());
    simulations.push_back(simulation);
}

// A Solve feeds back every simulation whose points reach it.
void Plan::feed_back(const PlannedNode& solve)
{
    for (const std::size_t s : solve.carries) {
        if (simulations[s].solve) {
            const Node& other = *simulations[s].solve;
            throw Error(
                fmt::format(
                    "a second solve after \"{}\": \"{}\" at line {} is already its solve; a create can have only one",
                    simulations[s].create->name, other.name, other.location.line))
                .in_node(solve.node->name)
                .at(solve.node->location);
        }
        simulations[s].solve = solve.node;
    }
}

// Binds every operator's arguments for the first frame, and checks them.
void Plan::bind_all()
{
    for (PlannedNode& planned : nodes)
        name_errors(planned.node->name, planned.node->location, [&] {
            find_made_by_sources(planned);
            const PlannedSimulation& simulation = simulations[planned.simulation];
            const FrameClock clock{simulation.fps, simulation.start, simulation.subframes};
            bind_arguments(*planned.node, *planned.op, clock, clock.at_step(simulation.start), false);
            planned.op->check();
        });
}

// Collects the attributes made by nodes of its sources' simulations, which come before it.
void Plan::find_made_by_sources(PlannedNode& planned) const
{
    for (const std::size_t source : planned.sources)
        for (std::size_t i = 0; &nodes[i] != &planned; ++i) {
            if (!nodes[source].carries.count(nodes[i].simulation)) continue;
            const Uses uses = uses_of(nodes[i]);
            planned.source_makes.insert(planned.source_makes.end(), uses.makes.begin(), uses.makes.end());
        }
}

void Plan::find_changes()
{
    for (PlannedNode& planned : nodes) {
        const std::string argument = varying_argument(*planned.node);
        if (planned.in_loop)
            planned.changes = "its points continue from frame to frame";
        else if (!argument.empty())
            planned.changes = fmt::format("its {} changes with the frame", argument);
        else if (planned.node->type->varies)
            planned.changes = "its result may differ in each frame";
        else
            for (const std::size_t input : planned.inputs)
                if (planned.changes.empty() && !nodes[input].once)
                    planned.changes = fmt::format("\"{}\" before it is evaluated again", nodes[input].node->name);
        if (keeps_all && planned.changes.empty()) planned.changes = "nothing is pruned";
        planned.once = planned.changes.empty();
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

std::set<std::string> Plan::unrequested_columns(std::size_t node) const
{
    std::set<std::string> names;
    for (const PlannedAttribute& attribute : simulations[nodes[node].simulation].attributes)
        if (attribute.kept && !attribute.group && !attribute.is_of_scene()) names.insert(attribute.name);
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
        if (!edit || (removed && edit->reads_indices())) return last;
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
            std::set<std::size_t> visited;
            while (!open.empty()) {
                const std::size_t at = open.back();
                open.pop_back();
                if (nodes[at].node->type->kind == NodeKind::Solve || !visited.insert(at).second) continue;
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
    std::map<std::string, AttributeValue> defaults;  // of the first node that gives one
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
    // A node after a merge may be the first to give these points a value.
    const auto given_later = [&](const PlannedAttribute& attribute) {
        const auto is_own = [&](std::size_t writer) { return nodes[writer].simulation == simulation; };
        if (std::any_of(attribute.written_by.begin(), attribute.written_by.end(), is_own)) return false;
        return std::any_of(attribute.made_by.begin(), attribute.made_by.end(), [&](std::size_t maker) {
            const std::vector<AttributeSpec> given = uses_of(nodes[maker]).defaults;
            return nodes[maker].carries.count(simulation) &&
                   std::any_of(given.begin(), given.end(),
                               [&](const AttributeSpec& spec) { return spec.name == attribute.name; });
        });
    };
    for (const PlannedAttribute& attribute : simulations[simulation].attributes) {
        const bool is_missing = attribute.used_before_made || !(made_here(attribute) || given_later(attribute));
        if (attribute.kept && known_attribute(attribute.name) && is_missing)
            columns.push_back(*known_attribute(attribute.name));
    }
    std::erase_if(columns,
                  [&](const AttributeSpec& spec) { return simulations[simulation].pruned.count(spec.name) > 0; });
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
    std::erase_if(
        groups, [&](const std::string& name) { return simulations[simulation].pruned.count(group_prefix + name) > 0; });
    return {groups.begin(), groups.end()};
}

std::int64_t Plan::first_frame() const
{
    std::int64_t first = simulations.front().start;
    for (const PlannedSimulation& simulation : simulations) first = std::min(first, simulation.start);
    return first;
}

}  // namespace rapid

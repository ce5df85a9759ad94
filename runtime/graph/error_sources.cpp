#include "runtime/graph/error_sources.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "runtime/graph/arguments.h"
#include "runtime/graph/changing_node.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/step_shape.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/grid_sequence.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/solver/collision/hits.h"
#include "runtime/solver/step_context.h"

namespace rapid {
namespace {

std::map<std::string, std::string, std::less<>>& declared_errors()
{
    static std::map<std::string, std::string, std::less<>> all;  // by type
    return all;
}

bool contains(const std::vector<std::string>& list, const std::string& name)
{
    return std::find(list.begin(), list.end(), name) != list.end();
}

// Calls f for a value, or for each value in a table.
void visit_entries(const Value& value, const std::function<void(const Value&)>& f)
{
    const Table* table = value.table();
    if (!table) return f(value);
    for (const Value& entry : table->list) visit_entries(entry, f);
    for (const auto& [key, entry] : table->numbered) visit_entries(entry, f);
    for (const auto& [key, entry] : table->named) visit_entries(entry, f);
}

// Returns true if a value is a motion, or contains or is moved by one.
bool has_motion(const Value& argument)
{
    bool found = false;
    visit_entries(argument, [&](const Value& value) {
        const ObjectPtr* object = value.get<ObjectPtr>();
        const bool varies = object && *object && (*object)->varies() && !value.object<PointFunction>();
        found |= varies || value.function();
    });
    return found;
}

// Returns what an object approximates a shape by, "a level set of voxel 0.05 m"; empty if it is exact.
std::string approximation_by(const Object& object)
{
    if (const auto* moving = dynamic_cast<const AnimatedShape*>(&object)) return approximation_by(*moving->rest());
    std::optional<double> voxel;
    if (const auto* deforming = dynamic_cast<const DeformingLevelSet*>(&object)) voxel = deforming->voxel();
    if (const auto* shape = dynamic_cast<const Shape*>(&object); shape && std::isfinite(shape->band()))
        voxel = shape->smallest_feature();
    if (voxel) return fmt::format("a level set of voxel {:.4g} m", *voxel);
    if (dynamic_cast<const LevelSetSequence*>(&object)) return "level sets of files";
    if (dynamic_cast<const DensityGrid*>(&object) || dynamic_cast<const GridSequence<DensityGrid>*>(&object))
        return "a fog";
    if (dynamic_cast<const VectorGrid*>(&object) || dynamic_cast<const GridSequence<VectorGrid>*>(&object))
        return "a grid of vectors";
    return {};
}

bool takes_shape(const Param& param)
{
    const auto mentions = [&](const char* word) { return param.type.find(word) != std::string::npos; };
    return mentions("shape") || mentions("mesh") || mentions("level set") || mentions("grid") || mentions("curve");
}

// Finds the sources of one simulation.
class Search {
public:
    Search(const Plan& plan, std::size_t simulation, ErrorSources& found)
        : planned_(plan.simulations[simulation]), found_(found)
    {
        for (const PlannedNode& node : plan.nodes)
            if (node.carries.count(simulation)) nodes_.push_back(&node);
        for (const PointCoupling& coupling : couplings_of(plan))
            is_coupled_ |= coupling.node->type->kind == NodeKind::Dynamic;
        for (const PlannedNode* node : nodes_) add_inputs_of_motion(*node);
        if (is_coupled_) columns_.insert("life");
    }

    void run()
    {
        for (const PlannedNode* node : nodes_) look_at(*node);
        found_.is_closed_form &= is_closed_form();
    }

private:
    static bool acts_in_solve(const PlannedNode& planned)
    {
        const NodeKind kind = planned.node->type->kind;
        return planned.in_loop && (kind == NodeKind::Dynamic || kind == NodeKind::Solve);
    }

    void add_inputs_of_motion(const PlannedNode& planned)
    {
        if (!acts_in_solve(planned)) return;
        const Uses uses = uses_of(planned);
        std::set<std::string> inputs;
        for (const auto* names : {&uses.reads, &uses.may, &uses.takes}) inputs.insert(names->begin(), names->end());
        if (planned.node->type->kind == NodeKind::Solve) {
            // Ages decide when a point ends, not where it is; hits are only recorded.
            for (const char* name : {"age", "life", "id"}) inputs.erase(name);
            for (const char* name : Hits::names) inputs.erase(name);
        } else if (inputs.count("age")) {
            add(UnmeasuredError::Graph, planned.node->name, "which reads age, constant through a frame");
        }
        columns_.insert(inputs.begin(), inputs.end());
        for (const auto* names : {&uses.reads_groups, &uses.takes_groups}) groups_.insert(names->begin(), names->end());
    }

    std::string rate() const
    {
        return planned_.subframes == 1 ? "once per frame" : fmt::format("{} times per frame", planned_.subframes);
    }

    void add(UnmeasuredError::Source source, const std::string& name, const std::string& text)
    {
        found_.unmeasured.push_back({source, fmt::format("{}, {}", name, text)});
    }

    void look_at(const PlannedNode& planned)
    {
        const Node& node = *planned.node;
        const bool adds_points = node.type->has(Stage::Emission);
        if (!planned.in_loop) {
            if (contains(written_by(planned), "P"))
                add(UnmeasuredError::Graph, node.name,
                    planned_.solve ? fmt::format("which changes P after {}", planned_.solve->name)
                                   : fmt::format("which changes P {}", rate()));
            return;
        }
        if (adds_points && is_coupled_)
            add(UnmeasuredError::Graph, node.name, fmt::format("whose births meet other points {}", rate()));
        const auto declared = declared_errors().find(node.type->name);
        if (declared != declared_errors().end()) {
            if (!declared->second.empty()) add(UnmeasuredError::Graph, node.name, declared->second);
        } else if (node.type->kind == NodeKind::Points) {
            look_at_edit(planned);
        }
        if (node.type->kind == NodeKind::Dynamic || adds_points) look_at_arguments(node, adds_points);
        // The values that a :detail sets are the only ones of an action that belong to the frame.
        if (node.type->kind == NodeKind::Dynamic && contains(uses_of(planned).may, "detail"))
            add(UnmeasuredError::Graph, node.name, fmt::format("which reads values of a :detail, set {}", rate()));
    }

    // Returns the attributes on which motion depends and which a node writes, or may write.
    std::vector<std::string> written_by(const PlannedNode& planned) const
    {
        const Uses uses = uses_of(planned);
        std::set<std::string> written;
        for (const auto* names : {&uses.writes, &uses.may})
            for (const std::string& name : *names)
                if (columns_.count(name)) written.insert(name);
        return {written.begin(), written.end()};
    }

    void look_at_edit(const PlannedNode& planned)
    {
        const Node& node = *planned.node;
        const std::string& name = node.name;
        const std::size_t before = found_.unmeasured.size();
        if (const std::vector<std::string> written = written_by(planned); !written.empty())
            add(UnmeasuredError::Graph, name, fmt::format("which changes {} {}", fmt::join(written, ", "), rate()));
        const Uses uses = uses_of(planned);
        for (const std::string& group : std::set<std::string>(uses.makes_groups.begin(), uses.makes_groups.end()))
            if (groups_.count(group))
                add(UnmeasuredError::Graph, name, fmt::format("which chooses group \"{}\" {}", group, rate()));
        const PointEdit* edit = planned.op->as_point_edit();
        if (is_coupled_ && edit && edit->removes_points())
            add(UnmeasuredError::Graph, name, fmt::format("which removes points {} that others touch", rate()));
        if (found_.unmeasured.size() == before) return;
        for (const auto& [param, value] : node.arguments) look_at_shapes(fmt::format("{}.{}", name, param), value);
    }

    void look_at_arguments(const Node& node, bool adds_points)
    {
        const std::vector<std::string> functions = functions_of_the_frame(node);
        const std::vector<std::string> ignored = ChangingNode::ignored_changes(node);
        for (const auto& [param, value] : node.arguments) {
            const std::string name = fmt::format("{}.{}", node.name, param);
            if (contains(functions, param)) {
                // The first text is also that of a step (solve/step_observers.cpp).
                add(UnmeasuredError::Graph, name,
                    node.type->kind == NodeKind::Dynamic && contains(ignored, param)
                        ? "a function of the frame that is called once in each"
                        : fmt::format("a function of the frame whose values are known {}", rate()));
                if (takes_shape(*node.type->find(param)))
                    add(UnmeasuredError::Shapes, name, "which may be another shape in each frame");
            } else if (has_motion(value) && adds_points) {
                add(UnmeasuredError::Graph, name,
                    fmt::format("whose path is a curve through its positions {}", rate()));
            } else if (has_motion(value)) {
                add(UnmeasuredError::Shapes, name, fmt::format("whose motion is fitted by a track {}", rate()));
            }
            look_at_shapes(name, value);
        }
    }

    // Adds the approximations of shapes in an argument, and of those that a function of a point reaches.
    void look_at_shapes(const std::string& name, const Value& argument)
    {
        std::set<std::string> texts;
        visit_entries(argument, [&](const Value& value) {
            const ObjectPtr* object = value.get<ObjectPtr>();
            if (const auto function = value.object<PointFunction>())
                texts.merge(approximations_in(*function));
            else if (object && *object)
                texts.insert(approximation_by(**object));
        });
        texts.erase("");
        for (const std::string& text : texts) add(UnmeasuredError::Shapes, name, text);
    }

    std::set<std::string> approximations_in(const PointFunction& function) const
    {
        const std::optional<std::vector<ObjectPtr>> objects = function.objects();
        if (!objects) return {"which reaches too many values to find the shapes among them"};
        std::set<std::string> texts;
        for (const ObjectPtr& object : *objects) {
            const std::string approximation = approximation_by(*object);
            if (!approximation.empty()) texts.insert("which reaches " + approximation);
            if (is_moving_shape(*object))
                texts.insert(fmt::format("which reaches a shape whose motion is fitted by a track {}", rate()));
        }
        return texts;
    }

    // As is_closed_form() in solver/solve.h, for all points and frames.
    bool is_closed_form() const
    {
        for (const char* name : {"force", "airresist", "targetv"})
            if (const PlannedAttribute* attribute = planned_.find(name); attribute && attribute->kept) return false;
        return std::all_of(nodes_.begin(), nodes_.end(), [&](const PlannedNode* planned) {
            if (!acts_in_solve(*planned)) return true;
            const Node& node = *planned->node;
            if (const auto group = node.arguments.find("group");
                group != node.arguments.end() && !group->second.is_nil())
                return false;
            return node.type->kind == NodeKind::Solve || adds_uniform_force(node);
        });
    }

    bool adds_uniform_force(const Node& node) const
    {
        if (!node.type->has(Stage::Forces) || !functions_of_the_frame(node).empty()) return false;
        bool has_objects = false;
        for (const auto& [param, argument] : node.arguments)
            visit_entries(argument, [&](const Value& value) { has_objects |= value.get<ObjectPtr>() != nullptr; });
        if (has_objects) return false;  // no force of a shape is uniform
        const FrameClock clock{planned_.fps, planned_.start, planned_.subframes};
        const Frame frame = clock.at_step(planned_.start);
        const std::unique_ptr<Operator> op = node.type->make();
        bind_arguments(node, *op, clock, frame, false);
        FrameFigures figures;
        std::vector<std::string> warnings;
        const std::function<void(const std::string&, const PointSet&)> write;
        std::vector<Flow> inputs(1);
        const Flow flow = op->evaluate(
            inputs, {frame, false, node.name, node.location, RandomKey(0, node.name), figures, warnings, write});
        if (flow.dynamics.size() != 1 || flow.dynamics.forces().size() != 1) return false;
        const std::optional<Uniform> uniform = flow.dynamics.forces().front()->uniform();
        return uniform && has_closed_form(uniform->linear);
    }

    const PlannedSimulation& planned_;
    ErrorSources& found_;
    std::vector<const PlannedNode*> nodes_;                // those that carry its points
    std::set<std::string> columns_ = {"P", "v"}, groups_;  // on which motion depends
    bool is_coupled_ = false;
};

}  // namespace

GraphErrorRegistration::GraphErrorRegistration(std::string_view type, std::string_view text)
{
    declared_errors().emplace(type, text);
}

std::vector<std::string> ErrorSources::texts_of(UnmeasuredError::Source source) const
{
    std::vector<std::string> texts;
    for (const UnmeasuredError& error : unmeasured)
        if (error.source == source) texts.push_back(error.text);
    return texts;
}

ErrorSources error_sources_of(const Plan& plan)
{
    ErrorSources found;
    found.is_closed_form = true;
    for (std::size_t s = 0; s < plan.simulations.size(); ++s) Search(plan, s, found).run();
    return found;
}

}  // namespace rapid

#include "runtime/graph/coupling.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"

namespace rapid {
namespace {

// The type of a parameter that takes a function of all points at once (Kernel::set_function_type).
constexpr std::string_view whole_set_function_type = "function of the points";

constexpr const char* by_index = "may read p.index, the index of a point among all";

std::vector<CouplingRule>& rules()
{
    static std::vector<CouplingRule> all;
    return all;
}

const CouplingRule* rule_of(const std::string& type)
{
    const auto found =
        std::find_if(rules().begin(), rules().end(), [&](const CouplingRule& rule) { return rule.type == type; });
    return found == rules().end() ? nullptr : &*found;
}

// Returns a parameter for a function of all points at once; null if there is none.
const Param* whole_set_function_of(const NodeType& type)
{
    const auto found = std::find_if(type.params.begin(), type.params.end(),
                                    [](const Param& param) { return param.type == whole_set_function_type; });
    return found == type.params.end() ? nullptr : &*found;
}

// Returns false if the function only computes detail values from the frame and earlier detail values.
bool reads_whole_set(const PlannedNode& planned, const Param& param)
{
    const auto argument = planned.node->arguments.find(param.name);
    if (argument == planned.node->arguments.end()) return true;
    const auto function = argument->second.object<PointFunction>();
    return !function || function->reads_indices();
}

bool reads_indices(const PlannedNode& planned)
{
    if (const PointEdit* edit = planned.op->as_point_edit(); edit && edit->reads_indices()) return true;
    return std::any_of(planned.node->arguments.begin(), planned.node->arguments.end(), [](const auto& argument) {
        const auto function = argument.second.template object<PointFunction>();
        return function && function->reads_indices();
    });
}

std::string what_couples(const Plan& plan, const PlannedNode& planned)
{
    const NodeType& type = *planned.node->type;
    if (const Param* param = whole_set_function_of(type))
        return reads_whole_set(planned, *param) ? "its function reads all points" : "";
    if (reads_indices(planned)) return by_index;
    if (type.has(Stage::Constraints)) return "its constraints are solved for all points together";
    const CouplingRule* rule = rule_of(type.name);
    std::string what = rule ? rule->couples(plan, planned) : "";
    if (!what.empty()) return what;
    if (type.has(Stage::Emission) && !(rule && rule->take)) return "adds points, and can't leave any out";
    if (rule) return "";
    const bool alone = planned.op->as_point_edit() || type.kind == NodeKind::Dynamic || type.kind == NodeKind::Source;
    return alone ? "" : "may read all points, because RAPID_COUPLING does not state otherwise";
}

}  // namespace

CouplingRegistration::CouplingRegistration(CouplingRule rule) { rules().push_back(rule); }

std::vector<PointCoupling> couplings_of(const Plan& plan)
{
    std::vector<PointCoupling> found;
    for (const PlannedNode& planned : plan.nodes)
        if (std::string what = what_couples(plan, planned); !what.empty())
            found.push_back({planned.node, std::move(what)});
    return found;
}

void refuse_coupled(const Plan& plan)
{
    const std::vector<PointCoupling> found = couplings_of(plan);
    if (found.empty()) return;
    const auto& [node, what] = found.front();
    throw Error(fmt::format("{}: this scene can't be run in parts or as a sample; run all points", what))
        .in_node(node->name)
        .at(node->location);
}

void take_subset(const Plan& plan, const Subset& subset)
{
    refuse_coupled(plan);
    for (const PlannedNode& planned : plan.nodes)
        if (const CouplingRule* rule = rule_of(planned.node->type->name); rule && rule->take)
            rule->take(planned, subset);
}

std::optional<float> value_of_all(const Plan& plan, std::size_t simulation, const std::string& attribute)
{
    const PlannedAttribute* planned = plan.simulations[simulation].find(attribute);
    const AttributeSpec* known = known_attribute(attribute);
    if (!planned || !planned->written_by.empty()) return std::nullopt;
    float fallback = known ? std::get<float>(known->fallback) : 0;
    for (const AttributeSpec& spec : plan.columns_of(simulation))
        if (spec.name == attribute) fallback = std::get<float>(spec.fallback);

    std::optional<float> value;
    for (const PlannedNode& node : plan.nodes) {
        if (node.simulation != simulation) continue;
        for (const auto& [name, argument] : node.node->arguments)
            if (name == attribute && argument.function()) return std::nullopt;  // a changing default
        const CouplingRule* rule = rule_of(node.node->type->name);
        if (!rule || !rule->values) continue;
        const std::optional<std::vector<float>> values = rule->values(node, attribute, fallback);
        if (!values) return std::nullopt;
        for (const float here : *values)
            if (value.value_or(here) != here)
                return std::nullopt;
            else
                value = here;
    }
    return value ? value : fallback;
}

}  // namespace rapid

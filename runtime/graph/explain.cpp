#include "runtime/graph/explain.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/setting_names.h"
#include "runtime/graph/changing_node.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/point_function.h"

namespace rapid {
namespace {

struct StageWords {
    Stage stage;
    const char* name;
    const char* absent;  // the reason if a plan lacks it
};

constexpr StageWords stage_words[] = {
    {Stage::Emission, "emission", "no emit node"},
    {Stage::Script, "script", "no node has a Lua function"},
    {Stage::Forces, "forces", "no force node"},
    {Stage::Integration, "integration", "no solve node"},
    {Stage::Collision, "collision", "no collide node"},
    {Stage::ContactGrid, "contact grid", "no contact node"},
    {Stage::Constraints, "constraints", "no constraint node"},
    {Stage::ErrorEstimate, "error estimate", "no solve node"},
    {Stage::Writing, "writing", "no {} and no write node"},
};

bool runs_script(const Node& node)
{
    return std::any_of(node.arguments.begin(), node.arguments.end(), [](const auto& argument) {
        return argument.second.function() || argument.second.template object<PointFunction>();
    });
}

bool needs(const Node& node, Stage stage)
{
    if (stage == Stage::Script) return runs_script(node);
    return std::find(node.type->stages.begin(), node.type->stages.end(), stage) != node.type->stages.end();
}

std::string list_of_nodes(const Plan& plan, const std::vector<std::size_t>& nodes)
{
    std::vector<std::string> names;
    for (const std::size_t i : nodes) names.push_back(plan.nodes[i].node->name);
    return fmt::format("{}", fmt::join(names, ", "));
}

// "swirl reads it", "swirl, solve1 read it".
std::string done_by(const Plan& plan, const std::vector<std::size_t>& nodes, std::string_view verb)
{
    return fmt::format("{} {}{} it", list_of_nodes(plan, nodes), verb, nodes.size() == 1 ? "s" : "");
}

std::string why_kept(const Plan& plan, const PlannedAttribute& attribute)
{
    if (attribute.always) return "every point has it";
    std::vector<std::string> reasons;
    if (!attribute.read_by.empty()) reasons.push_back(done_by(plan, attribute.read_by, "read"));
    if (!attribute.written_by.empty()) reasons.push_back(done_by(plan, attribute.written_by, "write"));
    if (attribute.requested_by_name) reasons.push_back("an output requests it");
    if (attribute.requested_as_made && attribute.read_by.empty() && attribute.written_by.empty())
        reasons.push_back(done_by(plan, attribute.made_by, "make") +
                          ", and an output takes all attributes of the scene");
    if (attribute.kept_for_merge) reasons.push_back("its points are merged with points that have it");
    if (reasons.empty()) reasons.push_back("nothing is pruned");
    return fmt::format("{}", fmt::join(reasons, "; "));
}

std::string what_brings_in(const PlannedAttribute& attribute)
{
    if (attribute.name == "dt") return "a node that emits points within a frame";
    if (attribute.group) {
        const std::string name = attribute.name.substr(group_prefix.size());
        return fmt::format("p:within \"{0}\" in a kernel, group = \"{0}\" of a node, or {1} FILE:{0}", name,
                           name_of(Setting::Output));
    }
    return usual_way_to_keep(attribute.name);
}

// Returns the calls per frame: functions of Solves and of nodes upstream of them are called for each subframe.
int calls_per_frame(const Plan& plan, const PlannedNode& planned)
{
    return planned.in_loop ? plan.simulations[planned.simulation].subframes : 1;
}

std::string times_per_frame(int times)
{
    return times > 1 ? fmt::format("{} times per frame", times) : "once per frame";
}

// Returns the treatment of a function of the frame between its calls.
std::string between_calls(const PlannedNode& planned, const Param& param)
{
    if (planned.node->type->kind != NodeKind::Dynamic || !planned.in_loop) return "its value is constant in the frame";
    switch (ChangingNode::between_calls(*planned.node, param)) {
        case ChangingNode::Between::Interpolated:
            return "numbers are interpolated to the time of each substep; the estimated error includes the difference";
        case ChangingNode::Between::Held:
            return "its value at the end is used for the whole frame; the estimated error includes the difference";
        case ChangingNode::Between::Unfollowed:
            break;
    }
    return "its value at the end is used for the whole frame; the estimated error does not include the difference";
}

void explain_functions(const Plan& plan, const PlannedNode& planned, Explanation& result)
{
    for (const auto& [name, value] : planned.node->arguments) {
        const NodeType& type = *planned.node->type;
        const Param* param = type.find(name) ? type.find(name) : type.rest ? &*type.rest : nullptr;
        if (!param || !value.function()) continue;
        const std::string full = fmt::format("{}.{}", planned.node->name, name);
        if (param->keeps_function)
            result.functions.push_back(
                {full, "as often as its path needs",
                 "called between frames, until pieces of the path are within 1e-5 of its length"});
        else
            result.functions.push_back(
                {full, times_per_frame(calls_per_frame(plan, planned)), between_calls(planned, *param)});
    }
}

template <class T>
void sort_kept_first(std::vector<T>& all)
{
    std::stable_partition(all.begin(), all.end(), [](const T& one) { return one.kept; });
}

}  // namespace

std::size_t Explanation::bytes_per_point() const
{
    std::size_t bytes = 0;
    for (const ExplainedAttribute& attribute : attributes) bytes += attribute.bytes_per_point;
    return bytes;
}

std::string usual_way_to_keep(const std::string& attribute)
{
    return fmt::format("p.{0} in a kernel, rapid.attr \"{0}\", or {1} FILE:{0}", attribute, name_of(Setting::Output));
}

Explanation explain(const Plan& plan, const std::vector<std::string>& outputs)
{
    Explanation result;
    for (const PlannedNode& planned : plan.nodes) {
        const int times = calls_per_frame(plan, planned);
        const std::string why = plan.outputs.size() == 1 ? "leads to the output"
                                                         : fmt::format("leads to the output{} {}",
                                                                       planned.reached_from.size() == 1 ? "" : "s",
                                                                       fmt::join(planned.reached_from, ", "));
        result.nodes.push_back({planned.node->name, planned.node->type->name, true,
                                planned.once ? "once"
                                : times > 1  ? fmt::format("{} times per frame", times)
                                             : "every frame",
                                why, planned.changes});
        explain_functions(plan, planned, result);
    }
    for (const NodePtr& node : plan.pruned)
        result.nodes.push_back({node->name, node->type->name, false, "never", "leads to no output", ""});

    for (const PlannedSimulation& simulation : plan.simulations)
        for (const PlannedAttribute& attribute : simulation.attributes)
            result.attributes.push_back(
                {attribute.name, simulation.create->name, attribute.kept,
                 attribute.kept ? attribute.bytes_per_point() : 0,
                 attribute.kept ? why_kept(plan, attribute) : "no node reads it and no output requests it",
                 attribute.kept ? std::string() : what_brings_in(attribute)});
    sort_kept_first(result.attributes);

    for (const StageWords& words : stage_words) {
        std::vector<std::string> users;
        for (const PlannedNode& planned : plan.nodes)
            if (needs(*planned.node, words.stage)) users.push_back(planned.node->name);
        if (words.stage == Stage::Writing)
            for (const std::string& output : outputs) users.push_back(name_of(Setting::Output) + " " + output);
        result.stages.push_back({words.name, !users.empty(),
                                 users.empty() ? fmt::format(fmt::runtime(words.absent), name_of(Setting::Output))
                                               : fmt::format("{}", fmt::join(users, ", "))});
    }
    sort_kept_first(result.stages);

    for (const std::vector<std::size_t>& pass : plan.passes()) {
        std::vector<std::string>& names = result.passes.emplace_back();
        for (const std::size_t i : pass) names.push_back(plan.nodes[i].node->name);
    }
    for (const PointCoupling& coupling : couplings_of(plan))
        result.couplings.push_back({coupling.node->name, coupling.what});
    return result;
}

}  // namespace rapid

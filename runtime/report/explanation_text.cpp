#include "runtime/report/explanation_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/base/setting_names.h"

namespace rapid {
namespace {

// Rows of a table in columns: a name, a fact and a reason.
class Rows {
public:
    void add(std::string name, std::string fact, std::string why)
    {
        rows_.push_back({std::move(name), std::move(fact), std::move(why)});
    }

    std::string text(const std::string& heading) const
    {
        if (rows_.empty()) return {};
        std::size_t name = 0, fact = 0;
        for (const Row& row : rows_)
            name = std::max(name, width_of(row.name)), fact = std::max(fact, width_of(row.fact));
        std::string text = heading + '\n';
        for (const Row& row : rows_)
            text += fact == 0 ? fmt::format("  {:{}}  {}\n", printable_name(row.name), name, row.why)
                              : fmt::format("  {:{}}  {:{}}  {}\n", printable_name(row.name), name,
                                            printable_name(row.fact), fact, row.why);
        return text;
    }

private:
    struct Row {
        std::string name, fact, why;
    };
    std::vector<Row> rows_;
};

std::string bytes(std::size_t count) { return fmt::format("{} B", count); }

// Returns the name of an attribute, with its simulation if there are several.
std::string shown(const Explanation::ExplainedAttribute& attribute, const Explanation& plan)
{
    const bool several = attribute.simulation != plan.attributes.front().simulation ||
                         attribute.simulation != plan.attributes.back().simulation;
    return several ? fmt::format("{} of {}", attribute.name, attribute.simulation) : attribute.name;
}

std::string text_of_half(const Explanation& plan, bool kept)
{
    Rows nodes, attributes, stages;
    for (const auto& node : plan.nodes)
        if (node.kept == kept)
            nodes.add(node.name, kept ? node.evaluated : "",
                      node.changes.empty() ? node.why : fmt::format("{}; {}", node.why, node.changes));
    for (const auto& attribute : plan.attributes) {
        if (attribute.kept != kept) continue;
        const bool usual = kept || attribute.brought_in_by == usual_way_to_keep(attribute.name);
        attributes.add(shown(attribute, plan), kept ? bytes(attribute.bytes_per_point) : "",
                       usual ? attribute.why : fmt::format("{}; {} adds it", attribute.why, attribute.brought_in_by));
    }
    for (const auto& stage : plan.stages)
        if (stage.kept == kept) stages.add(stage.name, "", stage.why);
    const std::string of_attributes =
        kept ? fmt::format(" attributes, at most {} bytes per point", plan.bytes_per_point())
             : fmt::format(" attributes ({} adds one)", usual_way_to_keep("NAME"));
    return (kept ? "KEPT\n" : "\nPRUNED\n") + nodes.text(" nodes") + attributes.text(of_attributes) +
           stages.text(" stages");
}

void add_nodes(JsonText& json, const Explanation& plan)
{
    json.list("nodes", plan.nodes, [&](const Explanation::ExplainedNode& node) {
        json.begin_object();
        json.members("name", node.name, "type", node.type, "kept", node.kept, "evaluated", node.evaluated, "why",
                     node.why);
        if (!node.changes.empty()) json.member("changes", node.changes);
        json.end();
    });
}

void add_attributes(JsonText& json, const Explanation& plan)
{
    json.list("attributes", plan.attributes, [&](const Explanation::ExplainedAttribute& attribute) {
        json.begin_object();
        json.members("name", attribute.name, "simulation", attribute.simulation, "kept", attribute.kept,
                     "bytes_per_point", attribute.bytes_per_point, "why", attribute.why);
        if (!attribute.brought_in_by.empty()) json.member("brought_in_by", attribute.brought_in_by);
        json.end();
    });
}

void add_stages(JsonText& json, const Explanation& plan)
{
    json.list("stages", plan.stages, [&](const Explanation::ExplainedStage& stage) {
        json.object("name", stage.name, "kept", stage.kept, "why", stage.why);
    });
}

}  // namespace

std::string to_json(const Explanation& plan)
{
    JsonText json;
    json.begin_object();
    add_nodes(json, plan);
    add_attributes(json, plan);
    json.list("functions", plan.functions, [&](const Explanation::ExplainedFunction& function) {
        json.object("name", function.name, "called", function.called, "between", function.between);
    });
    add_stages(json, plan);
    json.member("passes", plan.passes);
    json.key("parts");
    json.begin_object();
    json.member("possible", plan.couplings.empty());
    json.list("because", plan.couplings, [&](const Explanation::ExplainedCoupling& coupling) {
        json.object("name", coupling.name, "what", coupling.what);
    });
    json.end();
    json.member("bytes_per_point", plan.bytes_per_point());
    json.end();
    return json.text();
}

std::string json_of_surplus(const Explanation& surplus)
{
    JsonText json;
    json.begin_object();
    add_nodes(json, surplus);
    add_attributes(json, surplus);
    add_stages(json, surplus);
    json.end();
    return json.text();
}

std::string to_text(const Explanation& plan)
{
    std::string text = text_of_half(plan, true);
    Rows functions;
    for (const auto& function : plan.functions) functions.add(function.name, function.called, function.between);
    text += functions.text(" functions of the frame");
    text += " passes over the points\n";
    for (const std::vector<std::string>& pass : plan.passes) text += fmt::format("  {}\n", fmt::join(pass, ", "));
    if (plan.couplings.empty())
        return text + fmt::format(" parts: yes (run {}, {})\n", name_of(Setting::Part), name_of(Setting::Sample)) +
               text_of_half(plan, false);
    Rows couplings;
    for (const auto& coupling : plan.couplings) couplings.add(coupling.name, "", coupling.what);
    return text + couplings.text(" parts: no, because") + text_of_half(plan, false);
}

Explanation surplus(const Explanation& one, const Explanation& other)
{
    const auto lacks = [](const auto& all, const auto& key, const std::string& value) {
        return std::none_of(all.begin(), all.end(), [&](const auto& x) { return x.kept && key(x) == value; });
    };
    const auto type = [](const Explanation::ExplainedNode& node) { return node.type; };
    const auto name = [](const auto& named) { return named.name; };
    Explanation result;
    for (const auto& node : one.nodes)
        if (node.kept && lacks(other.nodes, type, node.type)) result.nodes.push_back(node);
    for (const auto& attribute : one.attributes)
        if (attribute.kept && lacks(other.attributes, name, attribute.name)) result.attributes.push_back(attribute);
    for (const auto& stage : one.stages)
        if (stage.kept && lacks(other.stages, name, stage.name)) result.stages.push_back(stage);
    return result;
}

std::string text_of_surplus(const std::string& file, const std::string& other, const Explanation& surplus)
{
    Rows nodes, attributes, stages;
    for (const auto& node : surplus.nodes) nodes.add(node.name, node.type, node.evaluated);
    for (const auto& attribute : surplus.attributes)
        attributes.add(attribute.name, bytes(attribute.bytes_per_point), attribute.why);
    for (const auto& stage : surplus.stages) stages.add(stage.name, "", stage.why);
    const std::string all = nodes.text(" node types") + attributes.text(" attributes") + stages.text(" stages");
    return fmt::format("{} NEEDS, AND {} DOES NOT\n{}", file, other, all.empty() ? "  nothing\n" : all);
}

std::string to_text(const std::string& heading, const std::vector<HeldBytes>& all)
{
    Rows rows;
    for (const HeldBytes& one : all) rows.add(one.name, bytes(one.bytes), one.what);
    return rows.text(heading);
}

}  // namespace rapid

// rapid explain: which parts of a scene are kept or left out, and why; and which ones a scene needs over another one.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bindings/command/command.h"
#include "bindings/command/frame_files.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/memory_limit.h"
#include "bindings/command/untrusted.h"
#include "runtime/graph/evaluate.h"
#include "runtime/graph/explain.h"
#include "runtime/printable.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

ordered_json json_of(const Explanation::ExplainedNode& node)
{
    ordered_json json = {{"name", node.name},
                         {"type", node.type},
                         {"kept", node.kept},
                         {"evaluated", node.evaluated},
                         {"why", node.why}};
    if (!node.changes.empty()) json["changes"] = node.changes;
    return json;
}

ordered_json json_of(const Explanation::ExplainedAttribute& attribute)
{
    ordered_json json = {{"name", attribute.name},
                         {"simulation", attribute.simulation},
                         {"kept", attribute.kept},
                         {"bytes_per_point", attribute.bytes_per_point},
                         {"why", attribute.why}};
    if (!attribute.brought_in_by.empty()) json["brought_in_by"] = attribute.brought_in_by;
    return json;
}

ordered_json json_of(const Explanation::ExplainedFunction& function)
{
    return {{"name", function.name}, {"called", function.called}, {"between", function.between}};
}

ordered_json json_of(const Explanation::ExplainedStage& stage)
{
    return {{"name", stage.name}, {"kept", stage.kept}, {"why", stage.why}};
}

ordered_json json_of(const Explanation::ExplainedCoupling& coupling)
{
    return {{"name", coupling.name}, {"what", coupling.what}};
}

template <class T>
ordered_json json_of(const std::vector<T>& all)
{
    ordered_json json = ordered_json::array();
    for (const T& one : all) json.push_back(json_of(one));
    return json;
}

ordered_json json_of(const Explanation& plan)
{
    return {{"nodes", json_of(plan.nodes)},
            {"attributes", json_of(plan.attributes)},
            {"functions", json_of(plan.functions)},
            {"stages", json_of(plan.stages)},
            {"passes", plan.passes},
            {"parts", {{"possible", plan.couplings.empty()}, {"because", json_of(plan.couplings)}}},
            {"bytes_per_point", plan.bytes_per_point()}};
}

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
            text += fact == 0 ? fmt::format("  {:{}}  {}\n", row.name, name, row.why)
                              : fmt::format("  {:{}}  {:{}}  {}\n", row.name, name, row.fact, fact, row.why);
        return text;
    }

private:
    struct Row {
        std::string name, fact, why;
    };
    std::vector<Row> rows_;
};

std::string bytes(std::size_t count) { return fmt::format("{} B", count); }

// The name of an attribute, with its simulation where there are several.
std::string shown(const Explanation::ExplainedAttribute& attribute, const Explanation& plan)
{
    const bool several = attribute.simulation != plan.attributes.front().simulation ||
                         attribute.simulation != plan.attributes.back().simulation;
    return several ? fmt::format("{} of {}", attribute.name, attribute.simulation) : attribute.name;
}

std::string text_of(const Explanation& plan, bool kept)
{
    Rows nodes, attributes, stages;
    for (const auto& node : plan.nodes)
        if (node.kept == kept)
            nodes.add(node.name, kept ? node.evaluated : "",
                      node.changes.empty() ? node.why : fmt::format("{}; {}", node.why, node.changes));
    for (const auto& attribute : plan.attributes) {
        if (attribute.kept != kept) continue;
        const bool usual = kept || attribute.brought_in_by == usual_way_in(attribute.name);
        attributes.add(
            shown(attribute, plan), kept ? bytes(attribute.bytes_per_point) : "",
            usual ? attribute.why : fmt::format("{}; {} brings it in", attribute.why, attribute.brought_in_by));
    }
    for (const auto& stage : plan.stages)
        if (stage.kept == kept) stages.add(stage.name, "", stage.why);
    const std::string of_attributes = kept
                                          ? fmt::format(" attributes, {} bytes a point at most", plan.bytes_per_point())
                                          : fmt::format(" attributes ({} brings one in)", usual_way_in("NAME"));
    return (kept ? "KEPT\n" : "\nLEFT OUT\n") + nodes.text(" nodes") + attributes.text(of_attributes) +
           stages.text(" stages");
}

std::string text_of(const Explanation& plan)
{
    std::string text = text_of(plan, true);
    Rows functions;
    for (const auto& function : plan.functions) functions.add(function.name, function.called, function.between);
    text += functions.text(" functions of the frame");
    text += " passes over the points\n";
    for (const std::vector<std::string>& pass : plan.passes) text += fmt::format("  {}\n", fmt::join(pass, ", "));
    if (plan.couplings.empty()) return text + " parts: yes (run --part, --sample)\n" + text_of(plan, false);
    Rows couplings;
    for (const auto& coupling : plan.couplings) couplings.add(coupling.name, "", coupling.what);
    return text + couplings.text(" parts: no, because") + text_of(plan, false);
}

// The part that `one` keeps and `other` does not. Nodes are compared by type, as names differ from scene to scene.
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

ordered_json json_of_surplus(const Explanation& surplus)
{
    return {{"nodes", json_of(surplus.nodes)},
            {"attributes", json_of(surplus.attributes)},
            {"stages", json_of(surplus.stages)}};
}

class Explain : public Command, public Confined {
public:
    std::string name() const override { return "explain"; }
    std::string doc() const override { return "tells what a graph's plan keeps and leaves out, and why"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        files_.declare(app);
        app.add_option("--against", against_, "tells what one of two graphs needs and the other does not")
            ->type_name("GRAPH");
        app.add_option_function<std::string>(
               "--state", [this](const std::string& text) { state_after_ = read_frames(text).last; },
               "computes the frames up to this one, and tells what each node then keeps, as a snapshot holds it")
            ->type_name("FRAME");
        app.add_flag("--json", json_, "as JSON");
        untrusted_.declare(app, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        SandboxAccess access{{folder_of(graph_.file())}, {}};
        if (!against_.empty()) access.readable.push_back(folder_of(against_));
        untrusted_.confine([&] { return access; }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const auto end = end_at_limit(common);
            const MemoryLimit limit(graph_.file(), end);
            const Explanation here = explained(*graph_.load(false, end));
            if (against_.empty()) {
                ordered_json json = json_of(here);
                if (state_after_) json["state"] = state_;
                print(json_ ? json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + '\n'
                            : text_of(here) + text_of_state());
                return status_done;
            }
            const Explanation there = explained(*graph_.load_other(against_, end));
            const Explanation more = surplus(here, there), less = surplus(there, here);
            if (json_)
                print(ordered_json{{"graph", graph_.file()},
                                   {"against", against_},
                                   {"only_graph", json_of_surplus(more)},
                                   {"only_against", json_of_surplus(less)},
                                   {"bytes_per_point", {here.bytes_per_point(), there.bytes_per_point()}}}
                          .dump(2, ' ', false, ordered_json::error_handler_t::replace) +
                      '\n');
            else
                print(text_of_surplus(graph_.file(), against_, more) + '\n' +
                      text_of_surplus(against_, graph_.file(), less) +
                      fmt::format("\nbytes a point at most: {} and {}\n", here.bytes_per_point(),
                                  there.bytes_per_point()));
            return status_done;
        });
    }

private:
    Explanation explained(Session& session)
    {
        for (const std::string& warning : session.take_warnings()) print_warning(warning);
        PlanOptions options = files_.plan_options(graph_.seed());
        // Without -o: as an output that names no attributes.
        if (files_.names().empty()) options.all_made = true;
        const Plan plan(session.graph(), options);
        for (const std::string& warning : plan.warnings) print_warning(warning);
        files_.resolve(plan, true);
        Explanation explanation = explain(plan, files_.names());
        if (state_after_ && against_.empty()) find_state(plan);
        return explanation;
    }

    // Bytes by name: of the points of each Create, and of each node that keeps something.
    void find_state(const Plan& plan)
    {
        Evaluator evaluator(plan, [](auto&&...) {});
        if (*state_after_ < plan.first_frame())
            throw Error(
                fmt::format("--state {}: it is before the scene's first frame, {}", *state_after_, plan.first_frame()));
        while (evaluator.next_frame() <= *state_after_) evaluator.advance();
        const Snapshot snapshot = evaluator.save();
        state_ = {{"frame", snapshot.frame}};
        for (const auto& [name, state] : snapshot.simulations) state_["simulations"][name] = state.size();
        for (const auto& [name, state] : snapshot.nodes) state_["nodes"][name] = state.size();
    }

    std::string text_of_state() const
    {
        if (!state_after_) return {};
        Rows rows;
        for (const char* of : {"simulations", "nodes"})
            if (state_.contains(of))
                for (const auto& [name, size] : state_.at(of).items())
                    rows.add(name, bytes(size.get<std::size_t>()),
                             of == std::string_view("nodes") ? "of the node" : "points, ids and what is adopted");
        return rows.text(fmt::format("\nSTATE after frame {}", *state_after_));
    }

    GraphOptions graph_;
    FrameFiles files_;
    std::string against_;
    UntrustedOptions untrusted_;
    std::optional<std::int64_t> state_after_;  // a frame
    ordered_json state_;
    bool json_ = false;
};
RAPID_COMMAND(Explain);

}  // namespace
}  // namespace rapid

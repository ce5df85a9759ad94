#include "runtime/report/statistics.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/json.h"
#include "runtime/report/error_budget.h"
#include "runtime/solver/estimate/stiffness.h"

namespace rapid {

FrameFigures statistics_of(const FrameResult& result)
{
    FrameFigures frame = result.figures;
    frame.frame = result.frame;
    for (const auto& [name, points] : result.outputs) frame.points += points.size();
    frame.error.summarise();
    frame.frame_error.summarise();
    frame.energy_drift.summarise();
    for (const NodeWork& work : result.work) {
        const auto same = std::find_if(frame.nodes.begin(), frame.nodes.end(),
                                       [&](const NodeWork& node) { return node.nodes == work.nodes; });
        if (same == frame.nodes.end()) {
            frame.nodes.push_back(work);
        } else {
            same->seconds += work.seconds;
            same->points = work.points;
            same->bytes = work.bytes;
        }
    }
    // The stages are timed separately: rounding of the clock must not make the remainder negative.
    frame.seconds.graph = std::max(0.0, result.total_seconds - frame.seconds.script - frame.seconds.solve);
    return frame;
}

namespace {

template <class T>
void write(JsonText& json, const T& number_or_text)
{
    json.value(number_or_text);
}

void write(JsonText& json, const Ledger& ledger)
{
    const auto list = [](const Vec3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
    const auto& split = ledger.by.split;
    const auto residue = [&] {
        if (!ledger.residue) return json.value(nullptr);
        json.object("energy", ledger.residue->energy, "momentum", ledger.residue->momentum, "angular_momentum",
                    ledger.residue->angular_momentum);
    };
    json.object("kinetic", ledger.kinetic, "potential", ledger.potential, "elastic", ledger.elastic,  //
                "by_rods", ledger.by.rods, "by_contacts", ledger.by.contacts,                         //
                "by_friction", split ? std::optional(split->friction) : std::nullopt,                 //
                "by_shapes", split ? std::optional(split->shapes) : std::nullopt,                     //
                "by_pins", ledger.by.pins, "by_drag", ledger.by.drag, "by_motion", ledger.by_motion,  //
                "momentum", list(ledger.momentum), "angular_momentum", list(ledger.angular_momentum), "residue",
                residue);
}

void write(JsonText& json, const Sampled<ErrorQuantiles>& error)
{
    json.object("position_p50", error.summary->p50, "position_p95", error.summary->p95, "position_max",
                error.summary->max);
}

void write(JsonText& json, const Sampled<DriftSummary>& drift)
{
    if (!drift.summary) return json.value(nullptr);
    json.object("mean", drift.summary->mean, "max", drift.summary->max);
}

void write(JsonText& json, const ContactGrids& grids)
{
    json.object("points", grids.points, "error", grids.error, "excess", grids.excess, "search_seconds",
                grids.search_seconds);
}

void write(JsonText& json, const ContactEnergy& energy) { json.object("added", energy.added, "lost", energy.lost); }

void write(JsonText& json, const StageSeconds& seconds)
{
    json.object("total", seconds.total(), "graph", seconds.graph, "script", seconds.script, "solve", seconds.solve,
                "write", seconds.write);
}

void write(JsonText& json, const BandFigures& band)
{
    json.object("node", band.node, "width", band.width, "voxels", band.voxels, "seconds", band.seconds);
}

void write(JsonText& json, const NodeWork& work)
{
    json.object("nodes", work.nodes, "seconds", work.seconds, "points", work.points, "bytes", work.bytes);
}

void write(JsonText& json, const Stiffness& stiffness) { json.value(text_of(stiffness)); }

template <class T>
void write(JsonText& json, const std::optional<T>& value)
{
    write(json, *value);
}

template <class T>
void write(JsonText& json, const std::vector<T>& values)
{
    json.begin_list();
    for (const T& value : values) write(json, value);
    json.end();
}

void write(JsonText& json, const ErrorBudget& budget)
{
    const auto quantiles = [&](const ErrorQuantiles& error) {
        json.members("position_p50", error.p50, "position_p95", error.p95, "position_max", error.max);
    };
    const auto source = [&](const char* name, const std::optional<ErrorQuantiles>& error,
                            const std::vector<std::string>& missing) {
        json.key(name);
        json.begin_object();
        if (error && missing.empty())
            quantiles(*error);
        else
            json.member("not_estimated", missing);
        json.end();
    };
    json.begin_object();
    source("solver", budget.solver, budget.not_of_solver);
    source("graph", ErrorQuantiles(), budget.not_of_graph);
    source("shapes", ErrorQuantiles(), budget.not_of_shapes);
    json.key("rounding");
    json.object("position_max", budget.rounding);
    json.key("total");
    json.begin_object();
    quantiles(budget.total);
    json.member("is_complete", budget.is_complete);
    json.end();
    json.end();
}

std::string to_json(const FrameFigures& frame, const ErrorSources* errors)
{
    JsonText json;
    json.begin_object();
#define RAPID_FIGURE(type, name, together, later, reported, ...) \
    if (reported) {                                              \
        json.key(#name);                                         \
        write(json, frame.name);                                 \
    }
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    if (const auto budget = errors ? error_budget_of(frame, *errors) : std::nullopt) {
        json.key("error_by_source");
        write(json, *budget);
    }
    json.end();
    return json.text();
}

}  // namespace

std::string json_head(const RunStatistics& run)
{
    return fmt::format("{{ \"graph\": {}, \"threads\": {},\n  \"frames\": [", json_text(run.graph), run.threads);
}

std::string json_line(const FrameFigures& frame, bool first, const ErrorSources* errors)
{
    return fmt::format("{}\n    {}", first ? "" : ",", to_json(frame, errors));
}

std::string json_end(const RunStatistics& run)
{
    std::string text = "\n  ],\n";
    if (!run.stiff.empty()) {
        JsonText stiff;
        write(stiff, run.stiff);
        text += fmt::format("  \"stiff\": {},\n", stiff.text());
    }
    return text + fmt::format("  \"peak_bytes\": {}, \"seconds\": {} }}\n", run.peak_bytes, json_text(run.seconds));
}

}  // namespace rapid

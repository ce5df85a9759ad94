#include "runtime/report/statistics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "runtime/base/json_text.h"

namespace rapid {

using nlohmann::ordered_json;

StageSeconds& StageSeconds::operator+=(const StageSeconds& other)
{
    graph += other.graph;
    script += other.script;
    solve += other.solve;
    write += other.write;
    return *this;
}

namespace {

std::optional<FrameStatistics::Error> error_of(std::vector<double> errors)
{
    if (errors.empty()) return std::nullopt;
    const auto quantile = [&](double part) {
        const auto nth = errors.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(errors.size() - 1));
        std::nth_element(errors.begin(), nth, errors.end());
        return *nth;
    };
    return FrameStatistics::Error{quantile(0.5), quantile(0.95), quantile(1)};
}

std::optional<FrameStatistics::EnergyDrift> drift_of(const FrameFigures& figures)
{
    const std::vector<double>& drifts = figures.energy_drift;
    if (figures.has_no_energy || drifts.empty()) return std::nullopt;
    FrameStatistics::EnergyDrift result{0, 0};
    for (const double drift : drifts) {
        result.mean += drift / static_cast<double>(drifts.size());
        result.max = std::max(result.max, std::abs(drift));
    }
    return result;
}

}  // namespace

FrameStatistics statistics_of(const FrameResult& result)
{
    FrameStatistics frame;
    frame.frame = result.frame;
    for (const auto& [name, points] : result.outputs) frame.points += points.size();
    frame.born = result.figures.born;
    frame.died = result.figures.died;
    frame.collisions = result.figures.collisions;
    frame.contact_limit = result.figures.contact_limit;
    frame.trapped = result.figures.trapped;
    frame.beyond_tolerance = result.figures.beyond_tolerance;
    frame.error = error_of(result.figures.errors);
    frame.frame_error = error_of(result.figures.frame_errors);
    frame.left_out_of_errors = result.figures.left_out_of_errors;
    frame.rounding = result.figures.rounding;
    frame.energy_drift = drift_of(result.figures);
    frame.substeps = result.figures.substeps;
    frame.penetration_max = result.figures.penetration_max;
    frame.constraint_rows = result.figures.constraint_rows;
    frame.loose_constraints = result.figures.loose_constraints;
    frame.broken = result.figures.broken;
    frame.asleep = result.figures.asleep;
    frame.contact_search = result.figures.contact_search;
    frame.constraint_residual_max = result.figures.constraint_residual_max;
    frame.contact_energy = result.figures.contact_energy;
    frame.ledger = result.figures.ledger;
    frame.bands = result.figures.bands;
    frame.seconds.script = result.figures.script_seconds;
    frame.seconds.solve = result.figures.solve_seconds;
    for (const NodeWork& work : result.work) {
        const auto same = std::find_if(frame.nodes.begin(), frame.nodes.end(),
                                       [&](const FrameStatistics::Node& node) { return node.nodes == work.nodes; });
        if (same == frame.nodes.end())
            frame.nodes.push_back({work.nodes, work.seconds, work.points, work.bytes});
        else
            *same = {work.nodes, same->seconds + work.seconds, work.points, work.bytes};
    }
    // The stages are timed separately: rounding of the clock must not make the remainder negative.
    frame.seconds.graph = std::max(0.0, result.total_seconds - frame.seconds.script - frame.seconds.solve);
    return frame;
}

namespace {

void write(JsonText& json, const Ledger& ledger)
{
    const auto list = [](const Vec3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
    json.begin_object();
    json.member("kinetic", ledger.kinetic);
    json.member("potential", ledger.potential);
    json.member("elastic", ledger.elastic);
    json.member("by_rods", ledger.by.rods);
    json.member("by_contacts", ledger.by.contacts);
    if (ledger.by.split) {
        json.member("by_friction", ledger.by.split->friction);
        json.member("by_shapes", ledger.by.split->shapes);
    } else {
        json.member("by_friction", nullptr);
        json.member("by_shapes", nullptr);
    }
    json.member("by_pins", ledger.by.pins);
    json.member("by_drag", ledger.by.drag);
    json.member("by_motion", ledger.by_motion);
    json.member("momentum", list(ledger.momentum));
    json.member("angular_momentum", list(ledger.angular_momentum));
    json.key("residue");
    if (ledger.residue) {
        json.begin_object();
        json.member("energy", ledger.residue->energy);
        json.member("momentum", ledger.residue->momentum);
        json.member("angular_momentum", ledger.residue->angular_momentum);
        json.end();
    } else {
        json.value(nullptr);
    }
    json.end();
}

void write(JsonText& json, const FrameStatistics::Error& error)
{
    json.begin_object();
    json.member("position_p50", error.p50);
    json.member("position_p95", error.p95);
    json.member("position_max", error.max);
    json.end();
}

void write(JsonText& json, const StageSeconds& seconds)
{
    json.begin_object();
    json.member("total", seconds.total());
    json.member("graph", seconds.graph);
    json.member("script", seconds.script);
    json.member("solve", seconds.solve);
    json.member("write", seconds.write);
    json.end();
}

void write(JsonText& json, const BandFigures& band)
{
    json.begin_object();
    json.member("node", band.node);
    json.member("width", band.width);
    json.member("voxels", band.voxels);
    json.member("seconds", band.seconds);
    json.end();
}

void write(JsonText& json, const FrameStatistics::Node& node)
{
    json.begin_object();
    json.member("nodes", node.nodes);
    json.member("seconds", node.seconds);
    json.member("points", node.points);
    json.member("bytes", node.bytes);
    json.end();
}

std::string to_json(const FrameStatistics& frame)
{
    JsonText json;
    json.begin_object();
    json.member("frame", frame.frame);
    json.member("points", frame.points);
    json.member("born", frame.born);
    json.member("died", frame.died);
    json.member("substeps", frame.substeps);
    json.key("seconds");
    write(json, frame.seconds);
    if (frame.error) {
        json.key("error");
        write(json, *frame.error);
    }
    if (frame.frame_error) {
        json.key("frame_error");
        write(json, *frame.frame_error);
    }
    if (!frame.left_out_of_errors.empty()) json.member("left_out_of_errors", frame.left_out_of_errors);
    json.member("rounding", frame.rounding);
    json.key("energy_drift");
    if (frame.energy_drift) {
        json.begin_object();
        json.member("mean", frame.energy_drift->mean);
        json.member("max", frame.energy_drift->max);
        json.end();
    } else {
        json.value(nullptr);
    }
    json.member("penetration_max", frame.penetration_max);
    json.member("constraint_residual_max", frame.constraint_residual_max);
    if (frame.constraint_rows > 0) {
        json.member("constraint_rows", frame.constraint_rows);
        json.member("loose_constraints", frame.loose_constraints);
    }
    if (frame.broken > 0) json.member("broken", frame.broken);
    json.member("asleep", frame.asleep);
    if (frame.contact_search) {
        json.key("contact_grids");
        json.begin_object();
        json.member("points", frame.contact_search->grids);
        json.member("error", frame.contact_search->error);
        json.member("excess", frame.contact_search->excess);
        json.member("search_seconds", frame.contact_search->seconds);
        json.end();
    }
    json.member("collisions", frame.collisions);
    json.key("contact_energy");
    json.begin_object();
    json.member("added", frame.contact_energy.added);
    json.member("lost", frame.contact_energy.lost);
    json.end();
    if (frame.ledger) {
        json.key("ledger");
        write(json, *frame.ledger);
    }
    if (!frame.bands.empty()) {
        json.key("bands");
        json.begin_list();
        for (const BandFigures& band : frame.bands) write(json, band);
        json.end();
    }
    json.member("contact_limit", frame.contact_limit);
    json.member("trapped", frame.trapped);
    json.member("beyond_tolerance", frame.beyond_tolerance);
    json.key("nodes");
    json.begin_list();
    for (const FrameStatistics::Node& node : frame.nodes) write(json, node);
    json.end();
    json.end();
    return json.text();
}

}  // namespace

std::string json_head(const RunStatistics& run)
{
    // A file name need not be UTF-8.
    const std::string graph = ordered_json(run.graph).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    return fmt::format("{{ \"graph\": {}, \"threads\": {},\n  \"frames\": [", graph, run.threads);
}

std::string json_line(const FrameStatistics& frame, bool first)
{
    return fmt::format("{}\n    {}", first ? "" : ",", to_json(frame));
}

std::string json_end(const RunStatistics& run)
{
    std::string text = "\n  ],\n";
    if (!run.stiff.empty()) {
        JsonText stiff;
        stiff.begin_list();
        for (const Stiffness& stiffness : run.stiff) stiff.value(text_of(stiffness));
        stiff.end();
        text += fmt::format("  \"stiff\": {},\n", stiff.text());
    }
    return text +
           fmt::format("  \"peak_bytes\": {}, \"seconds\": {} }}\n", run.peak_bytes, ordered_json(run.seconds).dump());
}

}  // namespace rapid

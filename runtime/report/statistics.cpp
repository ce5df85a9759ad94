#include "runtime/report/statistics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

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

ordered_json to_json(const Ledger& ledger)
{
    const auto list = [](const Vec3d& v) { return ordered_json{v.x(), v.y(), v.z()}; };
    ordered_json json = {{"kinetic", ledger.kinetic},
                         {"potential", ledger.potential},
                         {"elastic", ledger.elastic},
                         {"by_rods", ledger.by.rods},
                         {"by_contacts", ledger.by.contacts},
                         {"by_friction", nullptr},
                         {"by_shapes", nullptr},
                         {"by_pins", ledger.by.pins},
                         {"by_drag", ledger.by.drag},
                         {"by_motion", ledger.by_motion},
                         {"momentum", list(ledger.momentum)},
                         {"angular_momentum", list(ledger.angular_momentum)},
                         {"residue", nullptr}};
    if (ledger.by.split) {
        json["by_friction"] = ledger.by.split->friction;
        json["by_shapes"] = ledger.by.split->shapes;
    }
    if (ledger.residue)
        json["residue"] = {{"energy", ledger.residue->energy},
                           {"momentum", ledger.residue->momentum},
                           {"angular_momentum", ledger.residue->angular_momentum}};
    return json;
}

ordered_json to_json(const FrameStatistics::Error& error)
{
    return {{"position_p50", error.p50}, {"position_p95", error.p95}, {"position_max", error.max}};
}

ordered_json to_json(const FrameStatistics& frame)
{
    const StageSeconds& s = frame.seconds;
    ordered_json json = {
        {"frame", frame.frame},
        {"points", frame.points},
        {"born", frame.born},
        {"died", frame.died},
        {"substeps", frame.substeps},
        {"seconds",
         {{"total", s.total()}, {"graph", s.graph}, {"script", s.script}, {"solve", s.solve}, {"write", s.write}}}};
    if (frame.error) json["error"] = to_json(*frame.error);
    if (frame.frame_error) json["frame_error"] = to_json(*frame.frame_error);
    if (!frame.left_out_of_errors.empty()) json["left_out_of_errors"] = frame.left_out_of_errors;
    json["rounding"] = frame.rounding;
    json["energy_drift"] = nullptr;
    if (frame.energy_drift)
        json["energy_drift"] = {{"mean", frame.energy_drift->mean}, {"max", frame.energy_drift->max}};
    json["penetration_max"] = frame.penetration_max;
    json["constraint_residual_max"] = frame.constraint_residual_max;
    if (frame.constraint_rows > 0) json["constraint_rows"] = frame.constraint_rows;
    if (frame.constraint_rows > 0) json["loose_constraints"] = frame.loose_constraints;
    json["asleep"] = frame.asleep;
    if (frame.contact_search)
        json["contact_grids"] = {{"points", frame.contact_search->grids},
                                 {"error", frame.contact_search->error},
                                 {"excess", frame.contact_search->excess},
                                 {"search_seconds", frame.contact_search->seconds}};
    json["collisions"] = frame.collisions;
    json["contact_energy"] = {{"added", frame.contact_energy.added}, {"lost", frame.contact_energy.lost}};
    if (frame.ledger) json["ledger"] = to_json(*frame.ledger);
    for (const BandFigures& band : frame.bands)
        json["bands"].push_back(
            {{"node", band.node}, {"width", band.width}, {"voxels", band.voxels}, {"seconds", band.seconds}});
    json["contact_limit"] = frame.contact_limit;
    json["trapped"] = frame.trapped;
    json["beyond_tolerance"] = frame.beyond_tolerance;
    ordered_json nodes = ordered_json::array();
    for (const FrameStatistics::Node& node : frame.nodes)
        nodes.push_back(
            {{"nodes", node.nodes}, {"seconds", node.seconds}, {"points", node.points}, {"bytes", node.bytes}});
    json["nodes"] = std::move(nodes);
    return json;
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
    return fmt::format("{}\n    {}", first ? "" : ",",
                       to_json(frame).dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

std::string json_end(const RunStatistics& run)
{
    std::string text = "\n  ],\n";
    if (!run.stiff.empty()) {
        ordered_json stiff = ordered_json::array();
        for (const Stiffness& stiffness : run.stiff) stiff.push_back(text_of(stiffness));
        text += fmt::format("  \"stiff\": {},\n", stiff.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
    }
    return text +
           fmt::format("  \"peak_bytes\": {}, \"seconds\": {} }}\n", run.peak_bytes, ordered_json(run.seconds).dump());
}

}  // namespace rapid

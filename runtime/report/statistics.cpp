#include "runtime/report/statistics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
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

std::optional<FrameStatistics::Error> error_of(std::vector<double> errors)
{
    if (errors.empty()) return std::nullopt;
    const auto quantile = [&](double part) {
        const auto place = errors.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(errors.size() - 1));
        std::nth_element(errors.begin(), place, errors.end());
        return *place;
    };
    return FrameStatistics::Error{quantile(0.5), quantile(0.95), quantile(1)};
}

std::optional<FrameStatistics::EnergyDrift> drift_of(const FrameFigures& figures)
{
    const std::vector<double>& drifts = figures.energy_drift;
    if (figures.has_no_energy || drifts.empty()) return std::nullopt;
    FrameStatistics::EnergyDrift of_all{0, 0};
    for (const double drift : drifts) {
        of_all.mean += drift / static_cast<double>(drifts.size());
        of_all.max = std::max(of_all.max, std::abs(drift));
    }
    return of_all;
}

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
    frame.energy_drift = drift_of(result.figures);
    frame.substeps = result.figures.substeps;
    frame.penetration_max = result.figures.penetration_max;
    frame.constraint_rows = result.figures.constraint_rows;
    frame.loose_constraints = result.figures.loose_constraints;
    frame.asleep = result.figures.asleep;
    frame.contact_search = result.figures.contact_search;
    frame.constraint_residual_max = result.figures.constraint_residual_max;
    frame.contact_energy = result.figures.contact_energy;
    frame.bands = result.figures.bands;
    frame.seconds.script = result.figures.script_seconds;
    frame.seconds.solve = result.figures.solve_seconds;
    // The stages are timed apart from the whole: rounding of the clock must not make the rest negative.
    frame.seconds.graph = std::max(0.0, result.total_seconds - frame.seconds.script - frame.seconds.solve);
    return frame;
}

StageSeconds RunStatistics::by_stage() const
{
    StageSeconds sum;
    for (const FrameStatistics& frame : frames) sum += frame.seconds;
    return sum;
}

std::uint64_t RunStatistics::point_frames() const
{
    std::uint64_t sum = 0;
    for (const FrameStatistics& frame : frames) sum += frame.points;
    return sum;
}

namespace {

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
    if (frame.error)
        json["error"] = {
            {"position_p50", frame.error->p50}, {"position_p95", frame.error->p95}, {"position_max", frame.error->max}};
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
    for (const BandFigures& band : frame.bands)
        json["bands"].push_back(
            {{"node", band.node}, {"width", band.width}, {"voxels", band.voxels}, {"seconds", band.seconds}});
    json["contact_limit"] = frame.contact_limit;
    json["trapped"] = frame.trapped;
    json["beyond_tolerance"] = frame.beyond_tolerance;
    return json;
}

// What it took to make bands as wide as the largest radius, or of shapes that deform, by node: a line each.
std::string bands_of(const RunStatistics& run)
{
    std::map<std::string, BandFigures> bands;
    for (const FrameStatistics& frame : run.frames)
        for (const BandFigures& band : frame.bands) {
            BandFigures& sum = bands[band.node];
            sum.width = std::max(sum.width, band.width);
            sum.voxels = std::max(sum.voxels, band.voxels);
            sum.seconds += band.seconds;
        }
    std::string text;
    for (const auto& [node, band] : bands)
        if (band.seconds > 0)
            text += fmt::format("band     of {}: {:.3g} m, {} voxels at most, {} to build\n", node, band.width,
                                with_separators(band.voxels), duration_text(band.seconds));
    return text;
}

// The audit of the collisions of all frames; nothing where there were none.
std::string contacts_of(const RunStatistics& run)
{
    std::uint64_t contacts = 0;
    double deepest = 0;
    ContactEnergy energy;
    for (const FrameStatistics& frame : run.frames) {
        contacts += frame.collisions;
        deepest = std::max(deepest, frame.penetration_max);
        energy += frame.contact_energy;
    }
    if (contacts == 0 && !(deepest > 0)) return {};
    return fmt::format("contacts {}, deepest {} at a frame's end; they took {:.3g} J, and added {:.3g} J\n",
                       with_separators(contacts), deepest > 0 ? fmt::format("{:.1e} m", deepest) : "0 m", energy.lost,
                       energy.added);
}

// "warning  points did so 5 times, in 3 frames from 7 to 48"; nothing where no frame counted any.
std::string doubtful_frames(const RunStatistics& run, std::uint64_t FrameStatistics::*count, std::string_view what)
{
    std::uint64_t points = 0, frames = 0;
    std::int64_t first = 0, last = 0;
    for (const FrameStatistics& frame : run.frames) {
        if (frame.*count == 0) continue;
        if (frames == 0) first = frame.frame;
        last = frame.frame;
        points += frame.*count;
        ++frames;
    }
    if (frames == 0) return "";
    const std::string where = frames == 1 ? fmt::format("in frame {}", first)
                                          : fmt::format("in {} frames from {} to {}", frames, first, last);
    return fmt::format("warning  {} {}, {}\n", what, points == 1 ? "once" : with_separators(points) + " times", where);
}

// What the integrator has done to the energy of motion; nothing where it has kept it, or where there is none.
std::string drift_of(const RunStatistics& run)
{
    if (run.frames.empty() || !run.frames.back().energy_drift) return "";
    const FrameStatistics::EnergyDrift& drift = *run.frames.back().energy_drift;
    if (drift.max == 0) return "";
    return fmt::format("energy   of motion, collisions aside: {:+.1e} J/kg since birth on average, {:.1e} at most\n",
                       drift.mean, drift.max);
}

// What is left of the constraints, where there are any, and in how many grids contacts were looked for.
std::string constraint_text(const RunStatistics& run)
{
    const auto worst = std::max_element(run.frames.begin(), run.frames.end(), [](const auto& a, const auto& b) {
        return a.constraint_residual_max < b.constraint_residual_max;
    });
    if (worst == run.frames.end() || worst->constraint_rows == 0) return "";
    std::string text =
        fmt::format("residual of constraints: {:.1e} m at most (frame {}), {:.1e} m in the last\n",
                    worst->constraint_residual_max, worst->frame, run.frames.back().constraint_residual_max);
    if (const auto& search = run.frames.back().contact_search) {
        double seconds = 0;
        for (const FrameStatistics& frame : run.frames)
            seconds += frame.contact_search ? frame.contact_search->seconds : 0;
        text += fmt::format("contacts in {} {} of {} points, cells {:.2g} times too large, searched in {:.3f} s\n",
                            search->grids.size(), search->grids.size() == 1 ? "grid" : "grids",
                            fmt::join(search->grids, ", "), search->excess, seconds);
    }
    return text;
}

std::string sleepers_of(const RunStatistics& run)
{
    if (run.frames.empty() || run.frames.back().asleep == 0) return "";
    const FrameStatistics& last = run.frames.back();
    return fmt::format("asleep   {} of {} points in the last frame\n", with_separators(last.asleep),
                       with_separators(last.points));
}

}  // namespace

std::string to_json(const RunStatistics& run)
{
    // A graph's name is what the file system allows, UTF-8 or not.
    const std::string graph = ordered_json(run.graph).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    std::string text = fmt::format("{{ \"graph\": {}, \"threads\": {}, \"peak_bytes\": {}, \"seconds\": {},\n", graph,
                                   run.threads, run.peak_bytes, ordered_json(run.seconds).dump());
    if (!run.stiff.empty()) {
        ordered_json stiff = ordered_json::array();
        for (const Stiffness& stiffness : run.stiff) stiff.push_back(text_of(stiffness));
        text += fmt::format("  \"stiff\": {},\n", stiff.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
    }
    text += "  \"frames\": [";
    for (const FrameStatistics& frame : run.frames)
        text += fmt::format("{}\n    {}", &frame == run.frames.data() ? "" : ",", to_json(frame).dump());
    return text + (run.frames.empty() ? "] }\n" : "\n  ] }\n");
}

std::string summary(const RunStatistics& run)
{
    const StageSeconds s = run.by_stage();
    std::string text;
    if (run.frames.empty()) {
        text += "points   none: no frame was run\n";
    } else {
        const auto most =
            std::max_element(run.frames.begin(), run.frames.end(),
                             [](const FrameStatistics& a, const FrameStatistics& b) { return a.points < b.points; });
        text += fmt::format("points   {}", with_separators(run.frames.back().points));
        if (most->points > run.frames.back().points)
            text += fmt::format(" (most: {} in frame {})", with_separators(most->points), most->frame);
        text += '\n';
    }
    text += fmt::format("frames   {} in {}", run.frames.size(), duration_text(run.seconds));
    if (run.point_frames() > 0 && run.seconds > 0)
        text += fmt::format(", {} points a second", in_millions(static_cast<double>(run.point_frames()) / run.seconds));
    text += fmt::format("\nseconds  graph {:.3f}, script {:.3f}, solve {:.3f}, write {:.3f}\n", s.graph, s.script,
                        s.solve, s.write);
    text += fmt::format("memory   {} at the peak\n", memory_text(run.peak_bytes));
    const auto worst = std::max_element(run.frames.begin(), run.frames.end(), [](const auto& a, const auto& b) {
        return (a.error ? a.error->max : -1) < (b.error ? b.error->max : -1);
    });
    if (worst != run.frames.end() && worst->error) {
        const FrameStatistics::Error& error = *worst->error;
        const auto within = [](double e, std::string_view unit) {
            return e > 0 ? fmt::format("below {:.1e}{}", e, unit) : "within rounding";
        };
        text += "error    since birth, estimated: ";
        text += error.max > 0 ? fmt::format("half of the points {}, 95 % {}, the worst {:.1e} (frame {})\n",
                                            within(error.p50, " m"), within(error.p95, ""), error.max, worst->frame)
                              : "none above rounding\n";
    }
    text += drift_of(run);
    text += contacts_of(run);
    text += constraint_text(run);
    text += sleepers_of(run);
    text += bands_of(run);
    text += advice(run.stiff);
    text += doubtful_frames(run, &FrameStatistics::contact_limit, "points reached the limit of contacts");
    text += doubtful_frames(run, &FrameStatistics::trapped, "points were deep in a shape");
    text += doubtful_frames(run, &FrameStatistics::loose_constraints, "constraints were off by a tenth of their size");
    text += doubtful_frames(run, &FrameStatistics::beyond_tolerance, "points needed more than max_substeps");
    return text;
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

std::string with_separators(std::uint64_t count)
{
    std::string text = std::to_string(count);
    for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, 1, ',');
    return text;
}

std::string in_millions(double count)
{
    if (count < 1e5) return with_separators(static_cast<std::uint64_t>(count));
    return fmt::format("{:.{}f} million", count / 1e6, count < 1e7 ? 2 : 1);
}

std::string memory_text(std::uint64_t bytes)
{
    const double mebibytes = static_cast<double>(bytes) / (1 << 20);
    return mebibytes < 1024 ? fmt::format("{:.1f} MiB", mebibytes) : fmt::format("{:.2f} GiB", mebibytes / 1024);
}

std::string duration_text(double seconds)
{
    if (seconds < 1) return fmt::format("{:.3f} s", seconds);
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    const auto whole = static_cast<std::uint64_t>(seconds + 0.5);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace rapid

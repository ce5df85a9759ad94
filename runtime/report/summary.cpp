// The summary of a run: a line for each subject.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "runtime/report/number_text.h"
#include "runtime/report/statistics.h"

namespace rapid {
namespace {

// The cost of building narrow bands: a line for each node.
std::string band_text(const RunStatistics& run)
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

// The audit of all collisions; empty where there were none.
std::string contact_text(const RunStatistics& run)
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

// "warning  points did so 5 times, in 3 frames from 7 to 48"; empty where no frame counted any.
std::string warning_text(const RunStatistics& run, std::uint64_t FrameStatistics::*count, std::string_view what)
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

// The change of the energy of motion by the integrator; empty where it is 0 or not defined.
std::string energy_text(const RunStatistics& run)
{
    if (run.frames.empty() || !run.frames.back().energy_drift) return "";
    const FrameStatistics::EnergyDrift& drift = *run.frames.back().energy_drift;
    if (drift.max == 0) return "";
    return fmt::format("energy   of motion, collisions aside: {:+.1e} J/kg since birth on average, {:.1e} at most\n",
                       drift.mean, drift.max);
}

// The residual of the constraints, where there are any, and the grids of the contact search.
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

std::string sleep_text(const RunStatistics& run)
{
    if (run.frames.empty() || run.frames.back().asleep == 0) return "";
    const FrameStatistics& last = run.frames.back();
    return fmt::format("asleep   {} of {} points in the last frame\n", with_separators(last.asleep),
                       with_separators(last.points));
}

// The estimated errors of the frame with the largest one.
std::string error_text(const RunStatistics& run)
{
    const auto worst = std::max_element(run.frames.begin(), run.frames.end(), [](const auto& a, const auto& b) {
        return (a.error ? a.error->max : -1) < (b.error ? b.error->max : -1);
    });
    if (worst == run.frames.end() || !worst->error) return "";
    const FrameStatistics::Error& error = *worst->error;
    const auto within = [](double e, std::string_view unit) {
        return e > 0 ? fmt::format("below {:.1e}{}", e, unit) : "within rounding";
    };
    std::string text = "error    since birth, estimated: ";
    return text + (error.max > 0 ? fmt::format("half of the points {}, 95 % {}, the worst {:.1e} (frame {})\n",
                                               within(error.p50, " m"), within(error.p95, ""), error.max, worst->frame)
                                 : std::string("none above rounding\n"));
}

// What rounding of positions to single precision is off by; no sub-steps change that.
std::string rounding_text(const RunStatistics& run)
{
    const auto worst = std::max_element(run.frames.begin(), run.frames.end(),
                                        [](const auto& a, const auto& b) { return a.rounding < b.rounding; });
    if (worst == run.frames.end() || !(worst->rounding > 0)) return "";
    return fmt::format("rounding of positions since birth: {:.1e} m at most (frame {})\n", worst->rounding,
                       worst->frame);
}

}  // namespace

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
    text += error_text(run);
    text += rounding_text(run);
    text += energy_text(run);
    text += contact_text(run);
    text += constraint_text(run);
    text += sleep_text(run);
    text += band_text(run);
    text += advice(run.stiff);
    text += warning_text(run, &FrameStatistics::contact_limit, "points reached the limit of contacts");
    text += warning_text(run, &FrameStatistics::trapped, "points were deep in a shape");
    text += warning_text(run, &FrameStatistics::loose_constraints, "constraints were off by a tenth of their size");
    text += warning_text(run, &FrameStatistics::beyond_tolerance, "points were beyond the tolerance");
    return text;
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

}  // namespace rapid

// The summary of a run: a line for each subject.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "runtime/report/number_text.h"
#include "runtime/report/statistics.h"
#include "runtime/solver/estimate/stiffness.h"

namespace rapid {

void Total<Sampled<ErrorQuantiles>>::add(std::int64_t frame, const Sampled<ErrorQuantiles>& error)
{
    if (!error.summary) return;
    ++frames;
    if (worst && !(error.summary->max > worst->max)) return;
    worst = error.summary;
    worst_frame = frame;
}

void Total<std::vector<std::string>>::add(std::int64_t frame, const std::vector<std::string>& strings)
{
    for (const std::string& text : strings) first.emplace(text, frame);
}

void Total<std::optional<Ledger>>::add(std::int64_t, const std::optional<Ledger>& ledger)
{
    if (ledger && sum)
        sum->append(*ledger);
    else if (ledger)
        sum = ledger;
}

void Total<std::optional<ContactGrids>>::add(std::int64_t, const std::optional<ContactGrids>& grids)
{
    if (grids) search_seconds += grids->search_seconds;
}

void Total<std::vector<BandFigures>>::add(std::int64_t, const std::vector<BandFigures>& bands)
{
    for (const BandFigures& band : bands) {
        BandFigures& all = by_node[band.node];
        all.width = std::max(all.width, band.width);
        all.voxels = std::max(all.voxels, band.voxels);
        all.seconds += band.seconds;
    }
}

void RunTotals::add(const FrameFigures& figures)
{
#define RAPID_FIGURE(type, name, ...) name.add(figures.frame, figures.name);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    ++frames;
    if (!first_solved && figures.points > 0 && figures.substeps > 0) first_solved = figures.frame;
    last = figures;
}

namespace {

std::string points_text(const RunTotals& totals)
{
    if (totals.frames == 0) return "points   none: no frame was run\n";
    std::string text = fmt::format("points   {}", with_separators(totals.last.points));
    if (*totals.points.most > totals.last.points)
        text += fmt::format(" (most: {} in frame {})", with_separators(*totals.points.most), totals.points.max_frame);
    return text + '\n';
}

std::string frames_text(const RunTotals& totals, double run_seconds)
{
    std::string text = fmt::format("frames   {} in {}", totals.frames, duration_text(run_seconds));
    if (totals.points.sum > 0 && run_seconds > 0)
        text += fmt::format(", {} points a second", in_millions(static_cast<double>(totals.points.sum) / run_seconds));
    const StageSeconds& seconds = totals.seconds.sum;
    return text + fmt::format("\nseconds  graph {:.3f}, script {:.3f}, solve {:.3f}, write {:.3f}\n", seconds.graph,
                              seconds.script, seconds.solve, seconds.write);
}

std::string worst_text(const Total<Sampled<ErrorQuantiles>>& error, const std::string& what)
{
    const std::optional<ErrorQuantiles>& worst = error.worst;
    if (!worst) return "";
    // Errors that shadows cannot see must not be reported as zero.
    constexpr std::string_view same = "the same at twice the sub-steps";
    const auto within = [&](double e, std::string_view unit) {
        return e > 0 ? fmt::format("below {:.1e}{}", e, unit) : std::string(same);
    };
    if (!(worst->max > 0)) return fmt::format("error    {}: {}\n", what, same);
    return fmt::format("error    {}: half of the points {}, 95 % {}, the worst {:.1e} (frame {})\n", what,
                       within(worst->p50, " m"), within(worst->p95, ""), worst->max, error.worst_frame);
}

// Returns the estimated errors of the worst frames, and the contributions that none of them includes.
std::string error_text(const RunTotals& totals)
{
    if (!totals.first_solved && !totals.error.worst) return "";
    std::string text = worst_text(totals.error, "since birth, estimated") +
                       worst_text(totals.frame_error, fmt::format("of one frame, estimated in {} of {}",
                                                                  totals.frame_error.frames, totals.frames));
    if (text.empty()) text = "error    not estimated\n";
    for (const auto& [what, first] : totals.left_out_of_errors.first) {
        text += "left out of the error: " + what;
        if (first > totals.first_solved.value_or(0)) text += fmt::format(" (from frame {} on)", first);
        text += '\n';
    }
    return text;
}

// Returns the displacement by rounding positions to single precision. More substeps do not reduce it.
std::string rounding_text(const Total<double>& rounding)
{
    if (!(rounding.most > 0.0)) return "";
    return fmt::format("rounding of positions since birth: {:.1e} m at most (frame {})\n", *rounding.most,
                       rounding.max_frame);
}

// Returns the change of kinetic energy by the integrator; empty if it is 0 or not defined.
std::string energy_text(const std::optional<DriftSummary>& drift)
{
    if (!drift || drift->max == 0) return "";
    return fmt::format("energy   of motion, collisions aside: {:+.1e} J/kg since birth on average, {:.1e} at most\n",
                       drift->mean, drift->max);
}

// Returns the sources of energy change of constrained points; empty if there are none.
std::string ledger_text(const std::optional<Ledger>& ledger)
{
    if (!ledger) return "";
    std::vector<std::string> parts;
    constexpr double rounding = 1e-6;  // of columns
    const double size = std::abs(ledger->kinetic) + std::abs(ledger->by.contacts) + std::abs(ledger->by.rods) +
                        std::abs(ledger->by.pins) + std::abs(ledger->by.drag) + std::abs(ledger->by_motion);
    const auto add = [&](const char* by, double change) {
        if (std::abs(change) > rounding * size) parts.push_back(fmt::format("{} {:+.3g}", by, change));
    };
    add("contacts", ledger->by.contacts);
    if (ledger->by.split) {
        add("friction", ledger->by.split->friction);
        add("moving shapes", ledger->by.split->shapes);
    }
    add("rods and springs", ledger->by.rods);
    add("pins", ledger->by.pins);
    add("drag", ledger->by.drag);
    add("all else", ledger->by_motion);
    std::string text = fmt::format("energy   {:.3g} J of constrained points", ledger->energy());
    if (!parts.empty()) text += fmt::format("; changed by {} J", fmt::join(parts, ", "));
    return text + '\n';
}

// Returns the audit of all collisions; empty if there were none.
std::string contact_text(const RunTotals& totals)
{
    const double deepest = totals.penetration_max.most.value_or(0);
    if (totals.collisions.sum == 0 && !(deepest > 0)) return "";
    return fmt::format("contacts {}, deepest {} at a frame's end; they took {:.3g} J, and added {:.3g} J\n",
                       with_separators(totals.collisions.sum), deepest > 0 ? fmt::format("{:.1e} m", deepest) : "0 m",
                       totals.contact_energy.sum.lost, totals.contact_energy.sum.added);
}

std::string broken_text(const Total<std::uint64_t>& broken)
{
    if (broken.sum == 0) return "";
    return fmt::format("broken   {} {}, the first in frame {}\n", with_separators(broken.sum),
                       broken.sum == 1 ? "pair" : "pairs", broken.first);
}

// Returns the residual of the constraints, if the frame with the worst one has any, and the grids of the contact
// search.
std::string constraint_text(const RunTotals& totals)
{
    const Total<double>& residual = totals.constraint_residual_max;
    const Total<std::uint64_t>& rows = totals.constraint_rows;
    // A residual of 0 is the worst in the first frame.
    if (!(residual.most > 0.0) && (rows.frames == 0 || rows.first != residual.max_frame)) return "";
    std::string text = fmt::format("residual of constraints: {:.1e} m at most (frame {}), {:.1e} m in the last\n",
                                   *residual.most, residual.max_frame, totals.last.constraint_residual_max);
    if (const auto& grids = totals.last.contact_grids)
        text += fmt::format("contacts in {} {} of {} points, cells {:.2g} times too large, searched in {:.3f} s\n",
                            grids->points.size(), grids->points.size() == 1 ? "grid" : "grids",
                            fmt::join(grids->points, ", "), grids->excess, totals.contact_grids.search_seconds);
    return text;
}

std::string sleep_text(const FrameFigures& last)
{
    if (last.asleep == 0) return "";
    return fmt::format("asleep   {} of {} points in the last frame\n", with_separators(last.asleep),
                       with_separators(last.points));
}

// Returns the cost of building narrow bands: a line for each node.
std::string band_text(const Total<std::vector<BandFigures>>& bands)
{
    std::string text;
    for (const auto& [node, band] : bands.by_node)
        if (band.seconds > 0)
            text += fmt::format("band     of {}: {:.3g} m, {} voxels at most, {} to build\n", node, band.width,
                                with_separators(band.voxels), duration_text(band.seconds));
    return text;
}

// Returns "warning  points did so 5 times, in 3 frames from 7 to 48"; empty if no frame counted any.
std::string warning_text(const Total<std::uint64_t>& total, std::string_view what)
{
    if (what.empty() || total.frames == 0) return "";
    const std::string where = total.frames == 1
                                  ? fmt::format("in frame {}", total.first)
                                  : fmt::format("in {} frames from {} to {}", total.frames, total.first, total.last);
    return fmt::format("warning  {} {}, {}\n", what, total.sum == 1 ? "once" : with_separators(total.sum) + " times",
                       where);
}

template <class T>
std::string warning_text(const Total<T>&, std::string_view)
{
    return "";
}

}  // namespace

std::string summary(const RunStatistics& run, const RunTotals& totals)
{
    std::string text = points_text(totals) + frames_text(totals, run.seconds) +
                       fmt::format("memory   {} at the peak\n", memory_text(run.peak_bytes)) + error_text(totals) +
                       rounding_text(totals.rounding) + energy_text(totals.last.energy_drift.summary) +
                       ledger_text(totals.ledger.sum) + contact_text(totals) + broken_text(totals.broken) +
                       constraint_text(totals) + sleep_text(totals.last) + band_text(totals.bands) + advice(run.stiff);
#define RAPID_FIGURE(type, name, together, later, reported, unit, meaning, chart, warning) \
    text += warning_text(totals.name, warning);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    return text;
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

}  // namespace rapid

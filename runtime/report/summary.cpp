// The summary of a run: six lines, the last of which says what to look at.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "runtime/base/setting_names.h"
#include "runtime/report/error_budget.h"
#include "runtime/report/number_text.h"
#include "runtime/report/statistics.h"
#include "runtime/solver/estimate/stiffness.h"

namespace rapid {

void Total<Sampled<ErrorQuantiles>>::add(std::int64_t, const Sampled<ErrorQuantiles>& error)
{
    if (!error.summary) return;
    ++frames;
    if (!worst || error.summary->max > worst->max) worst = error.summary;
}

void Total<std::vector<std::string>>::add(std::int64_t frame, const std::vector<std::string>& strings)
{
    for (const std::string& text : strings) first.emplace(text, frame);
}

void Total<std::vector<NodeWork>>::add(std::int64_t, const std::vector<NodeWork>& passes)
{
    for (const NodeWork& pass : passes) seconds[fmt::format("{}", fmt::join(pass.nodes, " + "))] += pass.seconds;
}

void RunTotals::add(const FrameFigures& figures)
{
#define RAPID_FIGURE(type, name, ...) name.add(figures.frame, figures.name);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    ++frames;
    if (!first_solved && figures.points > 0 && figures.substeps > 0) first_solved = figures.frame;
    last_points = figures.points;
}

void RunTotals::add_file(const std::string& path, bool is_film, std::uint64_t points_of_file, double seconds_of_file)
{
    writing_seconds[std::filesystem::path(path).extension().string()] += seconds_of_file;
    if (!is_film || films.insert(path).second) ++files;
    if (!fullest_file.empty() && points_of_file <= points_of_fullest) return;
    fullest_file = path;
    points_of_fullest = points_of_file;
}

namespace {

// m. Larger errors are usually visible in a picture.
constexpr double visible_error = 0.01;

// Formats a line of the summary. Labels are padded to one width.
std::string line(const char* label, const std::string& text) { return fmt::format("{:<9}{}\n", label, text); }

std::string points_text(const RunTotals& totals)
{
    if (totals.frames == 0) return line("points", "none: no frame was run");
    std::string text = with_separators(totals.last_points);
    if (*totals.points.most > totals.last_points)
        text += fmt::format(" (most: {} in frame {})", with_separators(*totals.points.most), totals.points.max_frame);
    return line("points", text);
}

std::string frame_count_text(const RunStatistics& run, const RunTotals& totals)
{
    std::string text = fmt::format("{} in {}", totals.frames, duration_text(run.seconds));
    if (totals.points.sum > 0 && run.seconds > 0)
        text +=
            fmt::format(", {} points per second", in_millions(static_cast<double>(totals.points.sum) / run.seconds));
    return line("frames", text + fmt::format(", {} of memory", memory_text(run.peak_bytes)));
}

std::string slowest_text(const RunTotals& totals)
{
    std::map<std::string, double> all = totals.nodes.seconds;
    for (const auto& [extension, seconds] : totals.writing_seconds) all["writing " + extension] += seconds;
    double sum = 0;
    for (const auto& [name, seconds] : all) sum += seconds;
    if (!(sum > 0)) return "";
    const auto slowest =
        std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    return line("slowest", fmt::format("{}, {:.0f} % of the work", slowest->first, 100 * slowest->second / sum));
}

// Returns the errors of the frames in which they are largest, by source. Nothing if none is estimated.
std::optional<ErrorBudget> worst_budget(const RunTotals& totals, const ErrorSources& sources)
{
    FrameFigures worst;
    worst.error.summary = totals.error.worst;
    worst.frame_error.summary = totals.frame_error.worst;
    worst.rounding = totals.rounding.most.value_or(0);
    for (const auto& [what, first] : totals.left_out_of_errors.first) worst.left_out_of_errors.push_back(what);
    return error_budget_of(worst, sources);
}

bool was_solved(const RunTotals& totals) { return totals.first_solved || totals.error.worst; }

std::string within(const ErrorQuantiles& error)
{
    const std::string most = length_text(error.p95), all = length_text(error.max);
    if (!(error.p95 > 0) || most == all) return fmt::format("all positions within {}", all);
    return fmt::format("95 % of the positions within {}, all within {}", most, all);
}

// Returns the sources of error that are not estimated, in the order solver, graph, shapes.
std::string unmeasured_text(const RunTotals& totals, const ErrorBudget& budget)
{
    std::string text;
    for (const auto* list : {&budget.not_of_solver, &budget.not_of_graph, &budget.not_of_shapes})
        for (const std::string& what : *list) {
            text += (text.empty() ? "not estimated: " : "; ") + what;
            const auto found = totals.left_out_of_errors.first.find(what);
            if (found != totals.left_out_of_errors.first.end() && found->second > totals.first_solved.value_or(0))
                text += fmt::format(" (from frame {} on)", found->second);
        }
    return text;
}

// Returns the error if all sources of it are estimated.
std::string complete_error(const ErrorQuantiles& by_solver, const ErrorBudget& budget)
{
    if (budget.is_exact) return fmt::format("0, but for rounding within {}", length_text(budget.rounding));
    if (!(by_solver.max > 0)) return "none found: twice the substeps give the same positions";
    return "estimated: " + within(budget.total);
}

// Returns the part of the error that is estimated, and the sources of the rest. The part is no bound of the whole: the
// sources may cancel one another.
std::string incomplete_error(const RunTotals& totals, const ErrorBudget& budget)
{
    const std::string unmeasured = unmeasured_text(totals, budget);
    const bool is_since_birth = totals.error.worst.has_value();
    const std::optional<ErrorQuantiles>& by_solver = is_since_birth ? totals.error.worst : totals.frame_error.worst;
    if (!by_solver) return unmeasured;
    std::string of_frame;
    if (!is_since_birth)
        of_frame = fmt::format(", in one frame ({} of {} estimated)", totals.frame_error.frames, totals.frames);
    if (by_solver->max > budget.rounding)
        return fmt::format("from substeps: {}{}; {}", within(budget.total), of_frame, unmeasured);
    return fmt::format("{}; twice the substeps give the same positions within rounding{}", unmeasured, of_frame);
}

std::string error_text(const RunStatistics& run, const RunTotals& totals, const std::optional<ErrorBudget>& budget)
{
    if (!was_solved(totals)) {
        std::vector<std::string> texts;
        for (const UnmeasuredError& error : run.errors.unmeasured) texts.push_back(error.text);
        if (texts.empty() || *totals.points.most == 0) return "";
        return line("error", fmt::format("not estimated: {}", fmt::join(texts, "; ")));
    }
    if (!budget) return line("error", "not estimated");
    return line("error",
                budget->is_complete ? complete_error(*totals.error.worst, *budget) : incomplete_error(totals, *budget));
}

std::string files_text(const RunTotals& totals)
{
    if (totals.files == 0)
        return line("files", fmt::format("none written; {} NAME.####.png writes pictures", name_of(Setting::Output)));
    return line("files", fmt::format("{} written; look at {}", with_separators(totals.files), totals.fullest_file));
}

// Returns a line if any frame has the figure. warning: a sentence, with {} for its number and its frames.
std::string warning_text(const Total<std::uint64_t>& total, std::string_view warning)
{
    if (warning.empty() || total.frames == 0) return "";
    const std::string where = total.frames == 1
                                  ? fmt::format("in frame {}", total.first)
                                  : fmt::format("in {} frames from {} to {}", total.frames, total.first, total.last);
    const std::string times = total.sum == 1 ? "once" : with_separators(total.sum) + " times";
    return line("look at", fmt::format(fmt::runtime(warning), times + ", " + where));
}

template <class T>
std::string warning_text(const Total<T>&, std::string_view)
{
    return "";
}

// Returns a line for each thing to look at, with what to do about it. If there is none, "all fine", unless a part of
// the error is not estimated.
std::string result_text(const RunStatistics& run, const RunTotals& totals, const std::optional<ErrorBudget>& budget)
{
    std::string text;
    if (totals.warnings > 0)
        text += line("look at", totals.warnings == 1 ? "the warning above"
                                                     : fmt::format("the {} warnings above", totals.warnings));
    if (totals.frames > 0 && *totals.points.most == 0)
        text += line("look at", "no frame has a point: emit more, keep points alive for longer, or run more frames");
#define RAPID_FIGURE(type, name, together, later, reported, unit, meaning, chart, warning) \
    text += warning_text(totals.name, warning);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    if (const auto& error = totals.error.worst; error && error->p95 > visible_error)
        text += line("look at", "the error of positions is visible: give :solve more substeps");
    for (const Stiffness& one : run.stiff)
        if (const auto& better = one.improvement; better && !one.is_exact())
            text += line("look at",
                         fmt::format("{} is stiff: estimated error {}; {} substeps would give {}", one.node,
                                     length_text(better->error), better->substeps, length_text(better->error_after)));
    if (!text.empty()) return text;
    const bool is_known =
        was_solved(totals) ? budget && budget->is_complete : run.errors.unmeasured.empty() || *totals.points.most == 0;
    return line("result", is_known ? "all fine" : "nothing to look at, but not all of the error is estimated");
}

}  // namespace

std::string summary(const RunStatistics& run, const RunTotals& totals)
{
    const std::optional<ErrorBudget> budget = worst_budget(totals, run.errors);
    return points_text(totals) + frame_count_text(run, totals) + slowest_text(totals) +
           error_text(run, totals, budget) + files_text(totals) + result_text(run, totals, budget);
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

}  // namespace rapid

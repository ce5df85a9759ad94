// The summary of a run: six lines, the last of which says whether all is fine.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "runtime/base/setting_names.h"
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

std::string within(const ErrorQuantiles& error)
{
    if (!(error.max > 0)) return "none found: twice the substeps give the same positions";
    if (!(error.p95 > 0)) return fmt::format("all positions within {}", length_text(error.max));
    return fmt::format("95 % of the positions within {}, all within {}", length_text(error.p95),
                       length_text(error.max));
}

// Returns the largest estimated error, and the contributions that it does not include.
std::string error_text(const RunTotals& totals)
{
    if (!totals.first_solved && !totals.error.worst) return "";
    std::string text = "not estimated";
    if (totals.error.worst)
        text = within(*totals.error.worst);
    else if (totals.frame_error.worst)
        text = within(*totals.frame_error.worst) +
               fmt::format(", in one frame ({} of {} estimated)", totals.frame_error.frames, totals.frames);
    const char* separator = "; without ";
    for (const auto& [what, first] : totals.left_out_of_errors.first) {
        text += separator + what;
        if (first > totals.first_solved.value_or(0)) text += fmt::format(" (from frame {} on)", first);
        separator = "; ";
    }
    return line("error", text);
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

// Returns "all fine", or a line for each thing to look at, with what to do about it.
std::string result_text(const RunStatistics& run, const RunTotals& totals)
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
    return text.empty() ? line("result", "all fine") : text;
}

}  // namespace

std::string summary(const RunStatistics& run, const RunTotals& totals)
{
    return points_text(totals) + frame_count_text(run, totals) + slowest_text(totals) + error_text(totals) +
           files_text(totals) + result_text(run, totals);
}

std::string advice(const std::vector<Stiffness>& stiff)
{
    std::string text;
    for (const Stiffness& stiffness : stiff) text += fmt::format("stiff    {}\n", text_of(stiffness));
    return text;
}

}  // namespace rapid

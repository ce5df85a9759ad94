// The picture of a study: error over run time, both axes logarithmic.
//
//   title and subtitle
//   +----------------------------+  line 1   order 2.00
//   | o--o                       |  line 2   exact
//   |     `-o--o                 |
//   |~~~~~~~~~~~~ rounding ~~~~~~|
//   +----------------------------+
//
// The colours of the page follow a light or dark theme; those of the lines stand out on both. Nothing is loaded from
// elsewhere: fonts are the viewer's.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/report/study.h"

namespace rapid {
namespace {

constexpr double width = 860, height = 480;                       // px
constexpr double left = 84, right = 600, top = 76, bottom = 416;  // of the plot
constexpr double legend_x = right + 24, legend_step = 44, radius = 4;

// Colours of medium lightness, for white and black backgrounds; neighbours differ in lightness as well as in hue, for
// the colour-blind.
constexpr std::array colours = {"#2b7fd4", "#e08214", "#159a74", "#c64a9a", "#7a68c9",
                                "#c9a100", "#d1483f", "#46a3c4", "#7d8f2e", "#9c6b4e"};

constexpr const char* style = R"(  <style>
    text { font: 13px system-ui, "DejaVu Sans", sans-serif; fill: #24292f }
    .title { font-size: 17px; font-weight: 600 } .small { font-size: 12px; fill: #57606a }
    .page { fill: #ffffff } .grid { stroke: #d8dee4 } .frame { stroke: #8c959f; fill: none }
    .rounding { fill: #8c959f; fill-opacity: 0.14 } .line { fill: none; stroke-width: 2; stroke-linejoin: round }
    .open { fill: #ffffff; stroke-width: 2 }
    @media (prefers-color-scheme: dark) {
      text { fill: #e6edf3 } .small { fill: #9da7b1 }
      .page { fill: #0d1117 } .grid { stroke: #262c34 } .frame { stroke: #6e7681 } .open { fill: #0d1117 }
    }
  </style>
)";

std::string escaped(const std::string& text)
{
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '>')
            result += "&gt;";
        else if (c == '"')
            result += "&quot;";
        else if (static_cast<unsigned char>(c) >= ' ')
            result += c;
    }
    return result;
}

std::string text_at(double x, double y, const std::string& text, const char* anchor = "start",
                    const char* kind = nullptr)
{
    return fmt::format("  <text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor,
                       kind ? fmt::format(" class=\"{}\"", kind) : "", escaped(text));
}

// "10 µs", "1 mm"; beyond common prefixes, "1e-12 m".
std::string decade_text(int power, const char* unit)
{
    constexpr std::array prefixes = {"n", "µ", "m", ""};
    const int place = power < 0 ? (power + 9) / 3 : 3;
    if (power < -9 || power > 3) return fmt::format("1e{} {}", power, unit);
    const double value = std::pow(10, power - 3 * (place - 3));
    return fmt::format("{:g} {}{}", value, prefixes[static_cast<std::size_t>(place)], unit);
}

// One logarithmic axis, of whole decades.
class Axis {
public:
    Axis(double from, double to) : from_(from), to_(to) {}

    void include(double value)
    {
        least_ = std::min(least_, value);
        most_ = std::max(most_, value);
    }
    bool empty() const { return !(least_ <= most_); }
    int first() const { return static_cast<int>(std::floor(std::log10(least_) + 1e-9)); }
    int last() const { return std::max(first() + 1, static_cast<int>(std::ceil(std::log10(most_) - 1e-9))); }
    // Decades per label, so that labels do not touch.
    int stride(int max_labels) const { return std::max(1, (last() - first() + max_labels - 1) / max_labels); }
    double place(double value) const
    {
        return from_ + (to_ - from_) * (std::log10(value) - first()) / (last() - first());
    }

private:
    double from_, to_;
    double least_ = std::numeric_limits<double>::infinity(), most_ = 0;
};

struct Axes {
    Axis time{left, right}, error{bottom, top};
    double rounding = 0;  // the largest of the rows; 0 where not known

    explicit Axes(const StudyResult& result)
    {
        for (const StudyRow& row : result.rows) {
            if (!row.failed.empty()) continue;
            time.include(row.median_seconds());
            if (row.error > 0) error.include(row.error);
            rounding = std::max(rounding, row.rounding);
        }
        if (rounding > 0) error.include(rounding / 2);
        if (error.empty()) error.include(1);
        if (time.empty()) time.include(1);
    }

    // An error of 0 is on the lower edge.
    double y(double value) const { return value > 0 ? std::min(bottom, error.place(value)) : bottom; }
};

std::string grid(const Axes& axes, bool metres)
{
    std::string svg;
    for (int power = axes.time.first(); power <= axes.time.last(); ++power) {
        const double x = axes.time.place(std::pow(10, power));
        svg += fmt::format("  <path class=\"grid\" d=\"M{:.1f} {} V{}\"/>\n", x, top, bottom);
        if ((power - axes.time.first()) % axes.time.stride(8) == 0)
            svg += text_at(x, bottom + 20, decade_text(power, "s"), "middle");
    }
    for (int power = axes.error.first(); power <= axes.error.last(); ++power) {
        const double y = axes.error.place(std::pow(10, power));
        svg += fmt::format("  <path class=\"grid\" d=\"M{} {:.1f} H{}\"/>\n", left, y, right);
        if ((power - axes.error.first()) % axes.error.stride(12) == 0)
            svg += text_at(left - 8, y + 4, metres ? decade_text(power, "m") : fmt::format("1e{}", power), "end");
    }
    if (axes.rounding > 0) {
        const double y = axes.y(axes.rounding);
        svg += fmt::format("  <rect class=\"rounding\" x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\"/>\n", left,
                           y, right - left, bottom - y);
        svg += text_at(right - 6, y - 6, "rounding of single precision", "end", "small");
    }
    svg += fmt::format("  <rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>\n", left, top,
                       right - left, bottom - top);
    return svg;
}

// Placement of the numbers beside a line's markers: one that would cover the previous one is omitted.
class Labels {
public:
    bool fits(double x, double y)
    {
        if (std::abs(x - x_) < 18 && std::abs(y - y_) < 12) return false;
        x_ = x;
        y_ = y;
        return true;
    }

private:
    double x_ = -width, y_ = -height;
};

// The marker of a row, filled if no other row beats it, with its step beside it.
std::string marker(const Axes& axes, const StudyRow& row, const std::string& step, bool best, const char* colour,
                   Labels& labels)
{
    const double x = axes.time.place(row.median_seconds()), y = axes.y(row.error);
    std::string title = fmt::format("error {:.3g}, {:.3f} ms", row.error, 1e3 * row.median_seconds());
    for (const auto& [knob, value] : row.knobs) title += fmt::format(", {} {}", knob, knob_text(value));
    std::string svg = fmt::format(
        "  <circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" stroke=\"{}\" {}><title>{}</title></circle>\n", x, y, radius,
        colour, best ? fmt::format("fill=\"{}\"", colour) : std::string("class=\"open\""), escaped(title));
    if (!step.empty() && labels.fits(x, y))
        svg += text_at(x + 7, y - 6, knob_text(row.knobs.at(step)), "start", "small");
    return svg;
}

std::string order_words(const StudyLine& line, std::size_t failed, bool shows_all)
{
    std::string words = line.order ? fmt::format("order {:.2f}", *line.order) : "";
    if (line.at_rounding) words = shows_all ? "exact" : "at rounding";
    if (failed > 0) words += fmt::format("{}{} failed", words.empty() ? "" : ", ", failed);
    return words;
}

}  // namespace

std::string to_svg(const StudyResult& result)
{
    const Study& study = result.study;
    const Axes axes(result);
    const std::string step = study.step();
    const std::vector<bool> best = result.best();
    const std::vector<StudyLine> lines = result.lines();
    const double legend_bottom = top + legend_step * static_cast<double>(lines.size()) + 40;
    const double page = std::max(height, legend_bottom);

    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">\n"
        "  <title>{2}: error against run time</title>\n",
        width, page, escaped(study.name));
    svg += style;
    svg += fmt::format("  <rect class=\"page\" width=\"{}\" height=\"{}\"/>\n", width, page);
    svg += text_at(left, 30, study.name, "start", "title");
    const std::string frames = study.last_frame_only ? fmt::format("in frame {}", study.last)
                                                     : fmt::format("over frames {} to {}", study.first + 1, study.last);
    const std::string measure = !study.compares()      ? "residual of the constraints"
                                : study.error == "own" ? "error, the study's own measure"
                                                       : study.error + " error of the positions";
    svg += text_at(left, 54, fmt::format("{} {}, against run time; lower and further left is better", measure, frames),
                   "start", "small");
    svg += grid(axes, study.error != "own");
    svg +=
        text_at((left + right) / 2, bottom + 44,
                step.empty() ? std::string("run time") : fmt::format("run time; the numbers are {}", step), "middle");

    std::size_t row = 0;
    for (std::size_t l = 0; l < lines.size(); ++l) {
        const char* colour = colours[l % colours.size()];
        std::string path, markers;
        std::size_t failed = 0;
        Labels labels;
        for (; row < result.rows.size() && study.line_of(result.rows[row].knobs) == lines[l].name; ++row) {
            const StudyRow& at = result.rows[row];
            if (!at.failed.empty()) {
                ++failed;
                continue;
            }
            path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", axes.time.place(at.median_seconds()),
                                axes.y(at.error));
            markers += marker(axes, at, step, best[row], colour, labels);
        }
        if (!path.empty()) svg += fmt::format("  <path class=\"line\" stroke=\"{}\" d=\"{}\"/>\n", colour, path);
        svg += markers;

        const double y = top + 14 + legend_step * static_cast<double>(l);
        svg += fmt::format("  <path class=\"line\" stroke=\"{}\" d=\"M{} {} h22\"/>\n", colour, legend_x, y - 4);
        svg += text_at(legend_x + 30, y, lines[l].name);
        svg += text_at(legend_x + 30, y + 17, order_words(lines[l], failed, result.shows_all()), "start", "small");
    }
    const double y = top + 14 + legend_step * static_cast<double>(lines.size());
    svg += fmt::format("  <circle cx=\"{}\" cy=\"{}\" r=\"{}\" class=\"frame\" style=\"fill: #8c959f\"/>\n",
                       legend_x + 11, y - 4, radius);
    svg += text_at(legend_x + 30, y, "no other row is better", "start", "small");
    return svg + "</svg>\n";
}

}  // namespace rapid

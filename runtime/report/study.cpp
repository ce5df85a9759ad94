#include "runtime/report/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "runtime/error.h"
#include "runtime/report/statistics.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

// An error is fitted, and told apart from another, where it is this many times what rounding alone may cause: below,
// rounding changes the slope (at 4 times, the order of an orbit over six halvings is still within 0.03 of 2).
constexpr double above_rounding = 4;

// Knobs that count steps are whole; others (a tolerance, a voxel) are the step's size.
bool counts_steps(const std::vector<Value>& values)
{
    return std::all_of(values.begin(), values.end(), [](const Value& value) {
        const double* number = value.get<double>();
        return number && *number >= 1 && *number == std::floor(*number);
    });
}

ordered_json json_of(const Value& value)
{
    if (const bool* boolean = value.get<bool>()) return *boolean;
    if (const std::string* text = value.get<std::string>()) return *text;
    const double number = *value.get<double>();
    constexpr double exact = 9007199254740992;  // 2^53
    if (number == std::floor(number) && std::abs(number) < exact) return static_cast<std::int64_t>(number);
    return number;
}

ordered_json json_of(const Knobs& knobs)
{
    ordered_json json = ordered_json::object();
    for (const auto& [name, value] : knobs) json[name] = json_of(value);
    return json;
}

std::string described(const Knobs& knobs)
{
    std::vector<std::string> words;
    for (const auto& [name, value] : knobs) words.push_back(name + " " + knob_text(value));
    return fmt::format("{}", fmt::join(words, ", "));
}

// Slope of y over x by least squares; none where x does not vary.
std::optional<double> slope(const std::vector<std::pair<double, double>>& points)
{
    double x_mean = 0, y_mean = 0;
    for (const auto& [x, y] : points) x_mean += x, y_mean += y;
    x_mean /= static_cast<double>(points.size());
    y_mean /= static_cast<double>(points.size());
    double xx = 0, xy = 0;
    for (const auto& [x, y] : points) xx += (x - x_mean) * (x - x_mean), xy += (x - x_mean) * (y - y_mean);
    if (!(xx > 0)) return std::nullopt;
    return xy / xx;
}

// What the error column is, for people: "rms error (m)".
std::string error_title(const Study& study)
{
    if (!study.compares()) return "residual of constraints (m)";
    return study.error == "own" ? "error (the study's own measure)" : study.error + " error of P (m)";
}

// With a comma before it; nothing where nothing is compared.
std::string reference_text(const Study& study)
{
    if (!study.compares()) return "";
    return ", against " + (study.reference ? described(*study.reference) : "the closed form");
}

std::string frames_text(const Study& study)
{
    return study.last_frame_only ? fmt::format("frame {}", study.last)
                                 : fmt::format("frames {} to {}", study.first + 1, study.last);
}

std::string order_text(const StudyLine& line)
{
    if (line.order) return fmt::format("order {:.2f}, fitted to {} rows", *line.order, line.fitted);
    return line.at_rounding ? "exact: every error is at rounding" : "no order: fewer than two rows to fit";
}

}  // namespace

std::string knob_text(const Value& value)
{
    const std::string* text = value.get<std::string>();
    return text ? *text : describe(value);
}

double p95_of(std::vector<double> values)
{
    const std::size_t rank = (95 * values.size() + 99) / 100 - 1;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank), values.end());
    return values[rank];
}

void Study::complete()
{
    std::vector<std::string> names;
    for (const auto& [knob, values] : sweep) {
        names.push_back(knob);
        std::set<std::string> texts;
        for (const Value& value : values)
            if (!texts.insert(knob_text(value)).second)
                throw Error(fmt::format("sweep: {} has the value {} twice", knob, knob_text(value)));
    }
    const auto check_name = [&](const std::string& what, const std::string& knob) {
        if (!sweep.count(knob))
            throw Error(fmt::format("{}: the sweep has no knob \"{}\"{}", what, knob, did_you_mean(knob, names)));
    };
    for (const std::string& line : lines) check_name("lines", line);
    if (reference)
        for (const auto& [knob, value] : *reference) check_name("reference", knob);

    std::vector<std::string> left;
    for (const std::string& knob : names)
        if (std::find(lines.begin(), lines.end(), knob) == lines.end()) left.push_back(knob);
    if (left.size() > 1)
        throw Error(fmt::format(
            "the knobs {} are all left for the step along a line; name all but one in lines: lines = \"{}\"",
            fmt::join(left, ", "), left.front()));
    if (left.size() == 1 && step().empty()) lines.push_back(left.front());  // its values are no steps
}

std::string Study::step() const
{
    for (const auto& [knob, values] : sweep) {
        const bool numbers = std::all_of(values.begin(), values.end(),
                                         [](const Value& value) { return value.get<double>() != nullptr; });
        if (numbers && std::find(lines.begin(), lines.end(), knob) == lines.end()) return knob;
    }
    return "";
}

std::vector<Knobs> Study::rows() const
{
    std::vector<Knobs> rows(1);
    std::vector<std::string> order = lines;
    if (const std::string along = step(); !along.empty()) order.push_back(along);
    for (const std::string& knob : order) {
        std::vector<Knobs> longer;
        for (const Knobs& row : rows)
            for (const Value& value : sweep.at(knob)) {
                longer.push_back(row);
                longer.back()[knob] = value;
            }
        rows = std::move(longer);
    }
    return rows;
}

std::string Study::label(const Knobs& knobs) const { return described(knobs); }

std::string Study::line_of(const Knobs& knobs) const
{
    if (lines.empty()) return name;
    std::vector<std::string> words;
    for (const std::string& knob : lines) {
        const Value& value = knobs.at(knob);
        // A word speaks for itself; a number needs its name.
        words.push_back(value.get<std::string>() ? knob_text(value) : knob + " " + knob_text(value));
    }
    return fmt::format("{}", fmt::join(words, ", "));
}

Knobs Study::reference_of(const Knobs& knobs) const
{
    Knobs result = *reference;
    result.insert(knobs.begin(), knobs.end());
    return result;
}

double StudyRow::median_seconds() const
{
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t half = sorted.size() / 2;
    return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

bool StudyRow::at_rounding() const { return error <= above_rounding * rounding; }

std::vector<StudyLine> StudyResult::lines() const
{
    const std::string step = study.step();
    const bool counts = !step.empty() && counts_steps(study.sweep.at(step));
    std::vector<StudyLine> lines;
    std::vector<std::pair<double, double>> points;
    std::size_t ran = 0;
    const auto close = [&] {
        StudyLine& line = lines.back();
        line.fitted = points.size();
        if (points.size() > 1) line.order = slope(points);
        line.at_rounding = ran > 0 && points.empty();
        points.clear();
        ran = 0;
    };
    for (const StudyRow& row : rows) {
        const std::string name = study.line_of(row.knobs);
        if (lines.empty() || lines.back().name != name) {
            if (!lines.empty()) close();
            lines.push_back({name, std::nullopt, 0, false});
        }
        if (!row.failed.empty()) continue;
        ++ran;
        if (row.at_rounding()) continue;
        const double value = step.empty() ? 1 : std::abs(*row.knobs.at(step).get<double>());
        points.emplace_back(counts ? -std::log(value) : std::log(value), std::log(row.error));
    }
    if (!lines.empty()) close();
    return lines;
}

std::vector<bool> StudyResult::best() const
{
    const auto error_of = [](const StudyRow& row) { return row.at_rounding() ? 0.0 : row.error; };
    std::vector<bool> best;
    for (const StudyRow& row : rows) {
        best.push_back(row.failed.empty() && std::none_of(rows.begin(), rows.end(), [&](const StudyRow& other) {
                           if (!other.failed.empty()) return false;
                           const double error = error_of(row), other_error = error_of(other);
                           const double time = row.median_seconds(), other_time = other.median_seconds();
                           return other_error <= error && other_time <= time &&
                                  (other_error < error || other_time < time);
                       }));
    }
    return best;
}

std::string to_text(const StudyResult& result)
{
    const Study& study = result.study;
    std::vector<std::string> knobs = study.lines;
    if (const std::string step = study.step(); !step.empty()) knobs.push_back(step);

    std::vector<std::vector<std::string>> table = {{""}};
    table[0].insert(table[0].end(), knobs.begin(), knobs.end());
    table[0].insert(table[0].end(), {"error", "run time", "least", "most"});
    const bool missing = std::any_of(result.rows.begin(), result.rows.end(), [](auto& row) { return row.missing > 0; });
    if (missing) table[0].push_back("missing");
    const std::vector<bool> best = result.best();
    for (std::size_t i = 0; i < result.rows.size(); ++i) {
        const StudyRow& row = result.rows[i];
        std::vector<std::string> cells = {best[i] ? "*" : ""};
        for (const std::string& knob : knobs) cells.push_back(knob_text(row.knobs.at(knob)));
        if (!row.failed.empty()) {
            cells.push_back("failed");
        } else {
            const auto [least, most] = std::minmax_element(row.seconds.begin(), row.seconds.end());
            cells.push_back(fmt::format("{:.3g}", row.error));
            for (const double seconds : {row.median_seconds(), *least, *most})
                cells.push_back(fmt::format("{:.3f} ms", 1e3 * seconds));
            if (missing) cells.push_back(with_separators(row.missing));
        }
        table.push_back(std::move(cells));
    }

    std::vector<std::size_t> widths(table[0].size());
    for (const auto& cells : table)
        for (std::size_t c = 0; c < cells.size(); ++c) widths[c] = std::max(widths[c], cells[c].size());
    std::string text = fmt::format("{}: {}, {}{}; median of {} runs\n\n", study.name, error_title(study),
                                   frames_text(study), reference_text(study), study.repeat_runs);
    for (std::size_t i = 0; i < table.size(); ++i) {
        std::string line;
        for (std::size_t c = 0; c < table[i].size(); ++c) {
            const bool words = c <= study.lines.size();
            line += words ? fmt::format("{:<{}}  ", table[i][c], widths[c])
                          : fmt::format("{:>{}}  ", table[i][c], widths[c]);
        }
        text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
    }
    text += '\n';
    for (const StudyLine& line : result.lines()) text += fmt::format("{}: {}\n", line.name, order_text(line));
    for (const StudyRow& row : result.rows)
        if (!row.failed.empty()) text += fmt::format("failed: {}: {}\n", study.label(row.knobs), row.failed);
    return text + "* no other row beats it in both error and run time\n";
}

ordered_json to_json(const StudyResult& result)
{
    const Study& study = result.study;
    ordered_json json = {{"name", study.name}, {"file", study.file}, {"machine", ordered_json::object()}};
    for (const auto& [what, value] : result.machine) json["machine"][what] = value;
    json["frames"] = {study.first, study.last};
    json["error"] = study.error;
    json["error_frames"] = study.last_frame_only ? "last" : "all";
    json["reference"] = study.reference    ? json_of(*study.reference)
                        : study.compares() ? ordered_json("closed form")
                                           : ordered_json();
    json["repeat_runs"] = study.repeat_runs;

    json["rows"] = ordered_json::array();
    const std::vector<bool> best = result.best();
    for (std::size_t i = 0; i < result.rows.size(); ++i) {
        const StudyRow& row = result.rows[i];
        ordered_json of_row = {{"line", study.line_of(row.knobs)}, {"knobs", json_of(row.knobs)}};
        if (row.failed.empty()) {
            const auto [least, most] = std::minmax_element(row.seconds.begin(), row.seconds.end());
            of_row.update({{"error", row.error},
                           {"seconds", row.median_seconds()},
                           {"seconds_min", *least},
                           {"seconds_max", *most},
                           {"at_rounding", row.at_rounding()},
                           {"compared", row.compared},
                           {"missing", row.missing}});
        } else {
            of_row.update({{"error", nullptr}, {"seconds", nullptr}, {"failed", row.failed}});
        }
        of_row["best"] = static_cast<bool>(best[i]);
        json["rows"].push_back(std::move(of_row));
    }
    json["lines"] = ordered_json::array();
    for (const StudyLine& line : result.lines())
        json["lines"].push_back({{"line", line.name},
                                 {"order", line.order ? ordered_json(*line.order) : ordered_json()},
                                 {"fitted", line.fitted},
                                 {"at_rounding", line.at_rounding}});
    return json;
}

}  // namespace rapid

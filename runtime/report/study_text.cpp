// A study as a table for people, and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/report/number_text.h"
#include "runtime/report/study.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

ordered_json json_of(const Value& value)
{
    if (const bool* boolean = value.get<bool>()) return *boolean;
    if (const std::string* text = value.get<std::string>()) return *text;
    if (const Vec3d* vector = value.get<Vec3d>()) return {vector->x(), vector->y(), vector->z()};
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

// The title of the error column: "rms error of P (m)".
std::string error_title(const Study& study)
{
    if (!study.compares()) return "residual of constraints (m)";
    return study.error == "own" ? "error (the study's own measure)" : study.error + " error of P (m)";
}

// Returns a text that begins with a comma; empty if nothing is compared.
std::string reference_text(const Study& study)
{
    if (!study.compares()) return "";
    return ", against " + (study.reference ? study.label(*study.reference) : "the closed form");
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

// Returns a row for each setting, below a row of titles; the knobs come first.
TextTable table_of(const StudyResult& result)
{
    const Study& study = result.study;
    std::vector<std::string> knobs = study.lines;
    if (const std::string step = study.step(); !step.empty()) knobs.push_back(step);

    TextTable table = {{""}};
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
    return table;
}

}  // namespace

std::string to_text(const StudyResult& result)
{
    const Study& study = result.study;
    std::string text = fmt::format("{}: {}, {}{}; median of {} runs\n\n", study.name, error_title(study),
                                   frames_text(study), reference_text(study), study.repeat_runs);
    text += table_text(table_of(result), study.lines.size() + 1) + '\n';
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

// A study as a table for people, and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "runtime/base/json.h"
#include "runtime/report/number_text.h"
#include "runtime/report/study.h"

namespace rapid {
namespace {

void add_knob(JsonText& json, const Value& value)
{
    if (const bool* boolean = value.get<bool>()) return json.value(*boolean);
    if (const std::string* text = value.get<std::string>()) return json.value(*text);
    if (const Vec3d* vector = value.get<Vec3d>()) return json.value(*vector);
    const double number = *value.get<double>();
    constexpr double exact = 9007199254740992;  // 2^53
    if (number == std::floor(number) && std::abs(number) < exact) return json.value(static_cast<std::int64_t>(number));
    json.value(number);
}

void add_knobs(JsonText& json, const Knobs& knobs)
{
    json.begin_object();
    for (const auto& [name, value] : knobs) {
        json.key(name);
        add_knob(json, value);
    }
    json.end();
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

std::string order_text(const StudyLine& line, bool shows_all)
{
    if (line.order) return fmt::format("order {:.2f}, fitted to {} rows", *line.order, line.fitted);
    if (!line.at_rounding) return "no order: fewer than two rows to fit";
    return shows_all ? "exact: every error is at rounding" : "the varied settings make no error above rounding";
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
    for (const StudyLine& line : result.lines())
        text += fmt::format("{}: {}\n", line.name, order_text(line, result.shows_all()));
    for (const std::string& source : result.held_fixed()) text += fmt::format("held fixed: {}\n", source);
    for (const StudyRow& row : result.rows)
        if (!row.failed.empty()) text += fmt::format("failed: {}: {}\n", study.label(row.knobs), row.failed);
    return text + "* no other row is better in both error and run time\n";
}

std::string to_json(const StudyResult& result)
{
    const Study& study = result.study;
    JsonText json(2);
    json.begin_object();
    json.members("name", study.name, "file", study.file, "machine", [&] {
        json.begin_object();
        for (const auto& [what, value] : result.machine) json.member(what, value);
        json.end();
    });
    json.members("frames", std::array{study.first, study.last}, "error", study.error, "error_frames",
                 study.last_frame_only ? "last" : "all");
    json.key("reference");
    if (study.reference)
        add_knobs(json, *study.reference);
    else
        json.value(study.compares() ? std::optional("closed form") : std::nullopt);
    json.member("repeat_runs", study.repeat_runs);
    const std::vector<bool> best = result.best();
    std::size_t number = 0;
    json.list("rows", result.rows, [&](const StudyRow& row) {
        json.begin_object();
        json.members("line", study.line_of(row.knobs), "knobs", [&] { add_knobs(json, row.knobs); });
        if (row.failed.empty()) {
            const auto [least, most] = std::minmax_element(row.seconds.begin(), row.seconds.end());
            json.members("error", row.error, "seconds", row.median_seconds(), "seconds_min", *least, "seconds_max",
                         *most, "at_rounding", row.at_rounding(), "compared", row.compared, "missing", row.missing);
        } else {
            json.members("error", nullptr, "seconds", nullptr, "failed", row.failed);
        }
        json.member("best", static_cast<bool>(best[number++]));
        json.end();
    });
    json.member("held_fixed", result.held_fixed());
    json.list("lines", result.lines(), [&](const StudyLine& line) {
        json.object("line", line.name, "order", line.order, "fitted", line.fitted, "at_rounding", line.at_rounding);
    });
    json.end();
    return json.text();
}

}  // namespace rapid

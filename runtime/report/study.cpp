#include "runtime/report/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "runtime/base/error.h"

namespace rapid {
namespace {

// An error is significant above this multiple of the error that rounding alone may cause: below it, rounding changes
// the fitted slope (at 4, the order of an orbit over six halvings is still within 0.03 of 2).
constexpr double above_rounding = 4;

// A knob of whole numbers counts steps; others (a tolerance, a voxel) are step sizes.
bool counts_steps(const std::vector<Value>& values)
{
    return std::all_of(values.begin(), values.end(), [](const Value& value) {
        const double* number = value.get<double>();
        return number && *number >= 1 && *number == std::floor(*number);
    });
}

// Returns the least-squares slope of y over x; nothing if x does not vary.
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
        std::set<std::string> strings;
        for (const Value& value : values)
            if (!strings.insert(knob_text(value)).second)
                throw Error(fmt::format("sweep: {} has the value {} twice; remove one", knob, knob_text(value)));
    }
    const auto check_name = [&](const std::string& what, const std::string& knob) {
        if (!sweep.count(knob))
            throw Error(fmt::format("{}: the sweep has no knob \"{}\"{}", what, knob, did_you_mean(knob, names)));
    };
    for (const std::string& line : lines) {
        check_name("lines", line);
        if (std::count(lines.begin(), lines.end(), line) > 1)
            throw Error(fmt::format("lines: \"{}\" appears twice; remove one", line));
    }
    if (reference)
        for (const auto& [knob, value] : *reference) check_name("reference", knob);

    std::vector<std::string> left;
    for (const std::string& knob : names)
        if (std::find(lines.begin(), lines.end(), knob) == lines.end()) left.push_back(knob);
    if (left.size() > 1)
        throw Error(fmt::format("a line can vary only one of the knobs {}; name the others in lines: lines = \"{}\"",
                                fmt::join(left, ", "), left.front()));
    if (left.size() == 1 && step().empty()) lines.push_back(left.front());  // its values are not steps
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

std::string Study::label(const Knobs& knobs) const
{
    std::vector<std::string> words;
    for (const auto& [knob, value] : knobs) words.push_back(knob + " " + knob_text(value));
    return fmt::format("{}", fmt::join(words, ", "));
}

std::string Study::line_of(const Knobs& knobs) const
{
    if (lines.empty()) return name;
    std::vector<std::string> words;
    for (const std::string& knob : lines) {
        const Value& value = knobs.at(knob);
        // A number needs the name of its knob; a word does not.
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

std::vector<std::string> StudyResult::held_fixed() const
{
    std::optional<std::vector<std::string>> fixed;
    for (const StudyRow& row : rows) {
        if (!row.failed.empty()) continue;
        if (!fixed) fixed = row.unmeasured;
        std::erase_if(*fixed, [&](const std::string& text) {
            return std::find(row.unmeasured.begin(), row.unmeasured.end(), text) == row.unmeasured.end();
        });
    }
    return study.reference ? fixed.value_or(std::vector<std::string>()) : std::vector<std::string>();
}

bool StudyResult::shows_all() const
{
    return !study.reference ||
           std::all_of(rows.begin(), rows.end(), [](const StudyRow& row) { return row.unmeasured.empty(); });
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

}  // namespace rapid

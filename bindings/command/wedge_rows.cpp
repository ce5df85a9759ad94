#include "bindings/command/wedge_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "runtime/error.h"

namespace rapid {
namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;

void check(const std::vector<SweptSetting>& settings, bool zip)
{
    std::set<std::string> names;
    for (const SweptSetting& setting : settings) {
        if (!names.insert(setting.name).second) throw Error(fmt::format("--vary: {} is varied twice", setting.name));
        const std::size_t count = setting.values.size(), first = settings.front().values.size();
        if (zip && count != first)
            throw Error(fmt::format("--zip: {} has {} values and {} has {}; they must have as many",
                                    settings.front().name, first, setting.name, count));
    }
}

std::vector<Settings> combinations(const std::vector<SweptSetting>& settings, bool zip)
{
    constexpr std::size_t most = 100000;
    std::size_t count = 1;
    for (const SweptSetting& setting : settings) {
        count = zip ? setting.values.size() : count * setting.values.size();
        if (count > most) throw Error(fmt::format("--vary: there are more than {} rows; vary less at a time", most));
    }
    std::vector<Settings> rows(count);
    for (std::size_t row = 0; row < count; ++row) {
        std::size_t rest = row;
        for (auto setting = settings.rbegin(); setting != settings.rend(); ++setting) {
            const std::size_t of = setting->values.size();
            rows[row].emplace_back(setting->name, setting->values[zip ? row : rest % of]);
            rest /= of;
        }
        std::reverse(rows[row].begin(), rows[row].end());
    }
    return rows;
}

// By the name in braces: the place of its setting. A PARAM that several nodes have is left out.
std::map<std::string, std::size_t> names_in_braces(const std::vector<SweptSetting>& settings)
{
    std::map<std::string, std::size_t> names;
    std::map<std::string, int> of_nodes;
    for (const SweptSetting& setting : settings)
        if (const std::size_t dot = setting.name.rfind('.'); dot != std::string::npos)
            ++of_nodes[setting.name.substr(dot + 1)];
    for (std::size_t k = 0; k < settings.size(); ++k) {
        const std::string& name = settings[k].name;
        const std::string param = name.substr(name.rfind('.') + 1);
        if (param != name && of_nodes[param] == 1) names.emplace(param, k);
    }
    for (std::size_t k = 0; k < settings.size(); ++k) names[settings[k].name] = k;
    return names;
}

std::string with_values(const std::string& pattern, const Settings& row,
                        const std::map<std::string, std::size_t>& names)
{
    std::string result;
    for (std::size_t at = 0; at < pattern.size();) {
        const std::size_t open = pattern.find('{', at), close = pattern.find('}', open);
        if (close == std::string::npos) return result + pattern.substr(at);
        result += pattern.substr(at, open - at);
        const std::string name = pattern.substr(open + 1, close - open - 1);
        at = close + 1;
        if (name == "output") {
            result += "{output}";
            continue;
        }
        const auto found = names.find(name);
        if (found == names.end()) {
            std::vector<std::string> known;
            for (const auto& [other, place] : names) known.push_back(other);
            throw Error(fmt::format("-o {}: {{{}}} is not varied{}", pattern, name, did_you_mean(name, known)));
        }
        std::string value = row[found->second].second;
        std::erase_if(value, [](char c) { return c == '{' || c == '}' || c == ' '; });  // of a vec3
        if (value.empty() || value.find_first_of("/#$%:") != std::string::npos || value.front() == '.')
            throw Error(
                fmt::format("-o {}: the value {} of {} can't be a part of a file's name; leave it out of the "
                            "pattern, or vary a parameter with plain values",
                            pattern, value, name));
        result += value;
    }
    return result;
}

// "{rate} and {substeps}": what is varied and not in the pattern.
std::string missing_names(const std::string& pattern, const std::vector<SweptSetting>& settings)
{
    std::map<std::size_t, std::string> shortest;
    for (const auto& [name, place] : names_in_braces(settings)) {
        std::string& text = shortest[place];
        if (text.empty() || name.size() < text.size()) text = name;
    }
    std::vector<std::string> missing;
    for (const auto& [place, name] : shortest) {
        const bool there = pattern.find('{' + name + '}') != pattern.npos ||
                           pattern.find('{' + settings[place].name + '}') != pattern.npos;
        if (!there && settings[place].values.size() > 1) missing.push_back('{' + name + '}');
    }
    return fmt::format("{}", fmt::join(missing, " and "));
}

[[noreturn]] void refuse_same_files(const std::string& pattern, const std::vector<SweptSetting>& settings,
                                    const std::string& row, const std::string& other)
{
    if (row == other) throw Error(fmt::format("--vary: {} is there twice; leave one out", row));
    const std::string missing = missing_names(pattern, settings);
    throw Error(fmt::format("-o {}: {} and {} write the same files; {}", pattern, row, other,
                            missing.empty() ? "leave one out" : fmt::format("put {} into the pattern", missing)));
}

}  // namespace

std::string WedgeRow::label() const
{
    std::string text;
    for (const auto& [name, value] : settings) text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
    return text;
}

std::vector<WedgeRow> wedge_rows(const std::vector<SweptSetting>& settings, bool zip,
                                 const std::vector<std::string>& patterns)
{
    check(settings, zip);
    const std::map<std::string, std::size_t> names = names_in_braces(settings);
    std::vector<WedgeRow> rows;
    std::map<std::string, std::string> written;  // by the file's name: the row
    for (Settings& row : combinations(settings, zip)) {
        rows.push_back({std::move(row), {}});
        for (const std::string& pattern : patterns) {
            const std::string name = with_values(pattern, rows.back().settings, names);
            const auto [other, is_new] = written.emplace(name, rows.back().label());
            if (!is_new) refuse_same_files(pattern, settings, other->second, rows.back().label());
            rows.back().outputs.push_back(name);
        }
    }
    return rows;
}

}  // namespace rapid

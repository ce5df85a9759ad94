#include "runtime/io/describe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

std::vector<double> numbers(float value) { return {value}; }
std::vector<double> numbers(std::int32_t value) { return {static_cast<double>(value)}; }
std::vector<double> numbers(std::int64_t value) { return {static_cast<double>(value)}; }
std::vector<double> numbers(const Vec3f& value) { return {value.x(), value.y(), value.z()}; }
std::vector<double> numbers(const Quatf& value) { return {value.x(), value.y(), value.z(), value.w()}; }

template <class T>
void extend(AttributeSummary& summary, const Column<T>& column)
{
    const std::size_t distinct = column.is_uniform() ? std::min<std::size_t>(1, column.size()) : column.size();
    for (std::size_t i = 0; i < distinct; ++i) {
        const std::vector<double> value = numbers(column[i]);
        if (std::memcmp(&column[i], &column[0], sizeof(T)) != 0) summary.uniform = false;
        if (!std::all_of(value.begin(), value.end(), [](double x) { return std::isfinite(x); })) {
            summary.not_finite += column.is_uniform() ? column.size() : 1;
            continue;
        }
        if (summary.min.empty()) summary.min = summary.max = value;
        for (std::size_t c = 0; c < value.size(); ++c) {
            summary.min[c] = std::min(summary.min[c], value[c]);
            summary.max[c] = std::max(summary.max[c], value[c]);
        }
    }
}

constexpr std::size_t max_texts = 8;  // that are shown

void extend(AttributeSummary& summary, const Column<Token>& column)
{
    std::vector<std::string_view> strings;
    for (const Token text : text_table(column).strings) strings.push_back(text.text());
    std::sort(strings.begin(), strings.end());
    summary.uniform = strings.size() <= 1;
    summary.strings = strings.size();
    strings.resize(std::min(strings.size(), max_texts));
    summary.first_strings.assign(strings.begin(), strings.end());
}

// Returns a text such as "bark" "leaf" ... of 40 texts.
std::string text_list(const AttributeSummary& a)
{
    std::string list;
    for (const std::string& text : a.first_strings)
        list += fmt::format("{}\"{}\"", list.empty() ? "" : " ", printable_name(text));
    return a.strings > a.first_strings.size() ? list + fmt::format(" ... of {} strings", a.strings) : list;
}

std::string number_list(const std::vector<double>& values)
{
    std::string text;
    for (const double value : values) text += fmt::format("{}{:.7g}", text.empty() ? "" : " ", value);
    return text;
}

std::string byte_count(std::size_t bytes)
{
    if (bytes < 10'000) return fmt::format("{} bytes", bytes);
    if (bytes < 10'000'000) return fmt::format("{:.1f} kB", 1e-3 * static_cast<double>(bytes));
    return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
}

}  // namespace

PointSummary describe(const PointSet& points)
{
    PointSummary summary{points.size(), points.bytes(), Box3f(), {}, {}};
    std::vector<std::string> names = further_attributes(points);
    names.insert(names.begin(), {"P", "v", "id"});
    for (const std::string& name : names) {
        const AnyColumn& column = *points.find(name);
        AttributeSummary& attribute = summary.attributes.emplace_back();
        attribute.name = name;
        attribute.type = type_of(column);
        attribute.uniform = true;
        std::visit([&](const auto& c) { extend(attribute, c); }, column);
    }
    const AttributeSummary& P = summary.attributes[0];
    if (!P.min.empty())
        summary.bounds =
            Box3f(Vec3d(P.min[0], P.min[1], P.min[2]).cast<float>(), Vec3d(P.max[0], P.max[1], P.max[2]).cast<float>());
    for (const auto& [name, members] : points.groups()) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < points.size(); ++i) count += members[i] != 0;
        summary.groups.push_back({name, count});
    }
    return summary;
}

std::string to_text(const PointSummary& summary)
{
    std::string text = fmt::format("points      {}\nmemory      {}\n", summary.points, byte_count(summary.bytes));
    if (!summary.bounds.isEmpty()) {
        const auto corner = [](const Vec3f& P) { return fmt::format("{:.7g} {:.7g} {:.7g}", P.x(), P.y(), P.z()); };
        text += fmt::format("bounds      {}  to  {}\n", corner(summary.bounds.min()), corner(summary.bounds.max()));
    }
    std::size_t width = 10;
    for (const AttributeSummary& a : summary.attributes) width = std::max(width, width_of(a.name));
    for (const GroupSummary& g : summary.groups) width = std::max(width, width_of(g.name));

    text += "attributes\n";
    for (const AttributeSummary& a : summary.attributes) {
        text += fmt::format("  {:<{}}  {:<5}", printable_name(a.name), width, type_name(a.type));
        if (!a.min.empty())
            text += a.uniform ? fmt::format("  {} everywhere", number_list(a.min))
                              : fmt::format("  {}  to  {}", number_list(a.min), number_list(a.max));
        if (a.strings > 0) text += fmt::format("  {}{}", text_list(a), a.uniform ? " everywhere" : "");
        if (a.not_finite > 0) text += fmt::format("  ({} not finite)", a.not_finite);
        text += '\n';
    }
    if (!summary.groups.empty()) text += "groups\n";
    for (const GroupSummary& g : summary.groups)
        text += fmt::format("  {:<{}}  {}\n", printable_name(g.name), width, g.members);
    return text;
}

std::string to_json(const PointSummary& summary)
{
    JsonText json;
    json.begin_object();
    json.members("points", summary.points, "bytes", summary.bytes);
    if (!summary.bounds.isEmpty()) {
        json.key("bounds");
        json.object("min", summary.bounds.min(), "max", summary.bounds.max());
    }
    json.list("attributes", summary.attributes, [&](const AttributeSummary& a) {
        json.begin_object();
        json.members("name", a.name, "type", type_name(a.type), "uniform", a.uniform, "min", a.min, "max", a.max,
                     "not_finite", a.not_finite);
        if (a.type == AttributeType::String) json.members("texts", a.strings, "first_texts", a.first_strings);
        json.end();
    });
    json.list("groups", summary.groups,
              [&](const GroupSummary& g) { json.object("name", g.name, "points", g.members); });
    json.end();
    return json.text();
}

}  // namespace rapid

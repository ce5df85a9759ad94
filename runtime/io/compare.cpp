#include "runtime/io/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <tuple>

#include "runtime/base/json.h"
#include "runtime/base/parallel.h"
#include "runtime/base/printable.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/id_order.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

double difference(double a, double b)
{
    if (a == b) return 0;  // also for infinities
    if (std::isnan(a) && std::isnan(b)) return 0;
    const double d = std::abs(a - b);
    return std::isfinite(d) ? d : infinite;
}

// The components of a value. Vectors and scalars of any type are compared in this form.
using Components = Eigen::Array<double, 4, 1>;

template <class T>
Components components(const T& value)
{
    Components result = Components::Zero();
    if constexpr (std::is_same_v<T, Vec3f>)
        result.head<3>() = value.array().template cast<double>();
    else if constexpr (std::is_same_v<T, Quatf>)
        result = value.coeffs().array().template cast<double>();
    else
        result[0] = static_cast<double>(value);
    return result;
}

struct ValueDifference {
    double amount;
    double scale;  // the reference of a relative tolerance
};

template <class A, class B>
ValueDifference difference(const A& a, const B& b)
{
    if constexpr (std::is_integral_v<A> && std::is_integral_v<B>) {
        if (a == b) return {0, 0};
        const double amount = std::abs(static_cast<double>(a) - static_cast<double>(b));
        return {std::max(1.0, amount), 0};  // distinct int64 values may be the same double
    } else if constexpr (std::is_same_v<A, Token> || std::is_same_v<B, Token>) {
        if constexpr (std::is_same_v<A, B>)
            if (a == b) return {0, 0};
        return {1, 0};
    } else {
        const Components x = components(a), y = components(b);
        Components d;
        for (int c = 0; c < 4; ++c) d[c] = difference(x[c], y[c]);
        const double scale = std::max(x.matrix().norm(), y.matrix().norm());
        return {d.isInf().any() ? infinite : d.matrix().norm(), std::isfinite(scale) ? scale : 0};
    }
}

// Sets everything except names and types, from the differences of the matched pairs.
void summarise(AttributeDifference& result, std::vector<double>& amounts, const IdMatch& match, const PointSet& a)
{
    if (amounts.empty()) return;
    double squares = 0;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < amounts.size(); ++i) {
        squares += amounts[i] * amounts[i];
        if (amounts[i] > amounts[worst]) worst = i;
    }
    result.max = amounts[worst];
    result.worst_id = result.max > 0 ? a.id()[match.a[worst]] : -1;
    result.rms = std::sqrt(squares / static_cast<double>(amounts.size()));
    // The smallest value that at least 95 % do not exceed.
    const std::size_t rank = (95 * amounts.size() + 99) / 100 - 1;
    std::nth_element(amounts.begin(), amounts.begin() + static_cast<std::ptrdiff_t>(rank), amounts.end());
    result.p95 = amounts[rank];
    result.same = result.different == 0;
}

template <class A, class B>
void compare_columns(AttributeDifference& result, const Column<A>& in_a, const Column<B>& in_b, const IdMatch& match,
                     const PointSet& a, double absolute, double relative)
{
    const Strided<A> values_a = in_a.read();
    const Strided<B> values_b = in_b.read();
    std::vector<double> amounts(match.a.size());
    std::vector<std::uint8_t> beyond(match.a.size());
    for_each_chunk(amounts.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto [amount, scale] = difference(values_a[match.a[i]], values_b[match.b[i]]);
            amounts[i] = amount;
            beyond[i] = amount > std::max(absolute, relative * scale);
        }
    });
    result.different = static_cast<std::size_t>(std::count(beyond.begin(), beyond.end(), 1));
    summarise(result, amounts, match, a);
}

bool is_scalar(const AnyColumn& column)
{
    return component_count(type_of(column)) == 1 && type_of(column) != AttributeType::String;
}

double bounds_diagonal(const PointSet& a, const PointSet& b)
{
    Box3d bounds;
    for (const PointSet* set : {&a, &b})
        for (std::size_t i = 0; i < set->size(); ++i)
            if (set->P()[i].allFinite()) bounds.extend(set->P()[i].cast<double>().eval());
    return bounds.isEmpty() ? 0 : bounds.diagonal().norm();
}

AttributeDifference compare_attribute(const std::string& name, const PointSet& a, const PointSet& b,
                                      const IdMatch& match, const Comparison& comparison)
{
    AttributeDifference result;
    result.name = name;
    const AnyColumn* in_a = a.find(name);
    const AnyColumn* in_b = b.find(name);
    if (in_a) result.type_a = type_name(type_of(*in_a));
    if (in_b) result.type_b = type_name(type_of(*in_b));
    const bool comparable = in_a && in_b && (in_a->index() == in_b->index() || (is_scalar(*in_a) && is_scalar(*in_b)));
    if (!comparable) {
        result.same = a.empty() && b.empty();
        result.different = match.a.size();
        return result;
    }
    const double absolute = name == "P" ? comparison.tolerance_P : 0;
    const double relative = name == "P" ? 0 : comparison.tolerance;
    std::visit([&](const auto& x, const auto& y) { compare_columns(result, x, y, match, a, absolute, relative); },
               *in_a, *in_b);
    return result;
}

AttributeDifference compare_group(const std::string& name, const PointSet& a, const PointSet& b, const IdMatch& match)
{
    AttributeDifference result;
    result.name = name;
    const Column<std::uint8_t> none_a(a.size(), 0), none_b(b.size(), 0);
    const Column<std::uint8_t>* in_a = a.find_group(name);
    const Column<std::uint8_t>* in_b = b.find_group(name);
    result.type_a = in_a ? "group" : "";
    result.type_b = in_b ? "group" : "";
    compare_columns(result, in_a ? *in_a : none_a, in_b ? *in_b : none_b, match, a, 0, 0);
    return result;
}

void check_ids_differ(const PointSet& points, const char* set)
{
    const std::vector<std::size_t> order = id_order(points.id());
    const Strided<std::int64_t> ids = points.id().read();
    for (std::size_t i = 1; i < points.size(); ++i) {
        const std::int64_t id = ids[order.empty() ? i : order[i]];
        if (id == ids[order.empty() ? i - 1 : order[i - 1]])
            throw Error(fmt::format("two points of {} have the id {}; points are compared by id, so ids must be unique",
                                    set, id));
    }
}

}  // namespace

// Merges the two sets in order of id.
IdMatch match_by_id(const PointSet& a, const PointSet& b)
{
    const std::vector<std::size_t> order_a = id_order(a.id()), order_b = id_order(b.id());
    // Also valid past the last element. Without an order, elements keep their own index.
    const auto index = [](const std::vector<std::size_t>& order, std::size_t i) {
        return i < order.size() ? order[i] : i;
    };
    IdMatch match;
    std::size_t i = 0, j = 0;
    while (i < a.size() || j < b.size()) {
        const std::size_t at_a = index(order_a, i), at_b = index(order_b, j);
        if (j == b.size() || (i < a.size() && a.id()[at_a] < b.id()[at_b])) {
            match.only_a.push_back(a.id()[at_a]);
            ++i;
        } else if (i == a.size() || b.id()[at_b] < a.id()[at_a]) {
            match.only_b.push_back(b.id()[at_b]);
            ++j;
        } else {
            match.a.push_back(at_a);
            match.b.push_back(at_b);
            ++i;
            ++j;
        }
    }
    return match;
}

Comparison compare(const PointSet& a, const PointSet& b, double tolerance)
{
    check_ids_differ(a, "A");
    check_ids_differ(b, "B");
    Comparison result;
    result.points_a = a.size();
    result.points_b = b.size();
    result.tolerance = tolerance;
    result.tolerance_P = tolerance * bounds_diagonal(a, b);
    IdMatch match = match_by_id(a, b);
    result.only_a = std::move(match.only_a);
    result.only_b = std::move(match.only_b);
    result.compared = match.a.size();

    std::set<std::string> names, groups;
    for (const PointSet* set : {&a, &b}) {
        for (const std::string& name : set->column_names()) names.insert(name);
        for (const std::string& name : set->group_names()) groups.insert(name);
    }
    std::vector<std::string> ordered = {"P", "v"};
    for (const std::string& name : names)
        if (name != "P" && name != "v" && name != "id") ordered.push_back(name);
    for (const std::string& name : ordered) result.attributes.push_back(compare_attribute(name, a, b, match, result));
    for (const std::string& name : groups) result.groups.push_back(compare_group(name, a, b, match));

    const auto same = [](const AttributeDifference& d) { return d.same; };
    result.same = result.only_a.empty() && result.only_b.empty() &&
                  std::all_of(result.attributes.begin(), result.attributes.end(), same) &&
                  std::all_of(result.groups.begin(), result.groups.end(), same);
    return result;
}

namespace {

// Returns a text such as `3 points are only in A: ids 1, 2, 7`.
std::string missing_text(const std::vector<std::int64_t>& ids, const char* set)
{
    if (ids.empty()) return "";
    constexpr std::size_t shown = 8;
    std::string text = fmt::format("{} {} only in {}: {}", ids.size(), ids.size() == 1 ? "point is" : "points are", set,
                                   ids.size() == 1 ? "id" : "ids");
    for (std::size_t i = 0; i < std::min(shown, ids.size()); ++i)
        text += fmt::format("{} {}", i > 0 ? "," : "", ids[i]);
    return text + (ids.size() > shown ? ", ...\n" : "\n");
}

std::string attribute_text(const AttributeDifference& d, std::size_t width)
{
    const std::string head = fmt::format("  {:<{}}  ", printable_name(d.name), width);
    if (d.type_a.empty() || d.type_b.empty())
        return head +
               fmt::format("only in {} ({})\n", d.type_a.empty() ? "B" : "A", d.type_a.empty() ? d.type_b : d.type_a);
    if (d.type_a == "string" && d.type_b == "string" && !d.same)
        return head + fmt::format("string {} differ (id {} first)\n", d.different, d.worst_id);
    const std::string type = d.type_a == d.type_b ? d.type_a : d.type_a + " / " + d.type_b;
    if (d.max == 0 && d.same) return head + fmt::format("{:<5}  equal\n", type);
    if (!d.same && d.max == 0) return head + fmt::format("{:<5}  can't be compared\n", type);
    return head + fmt::format("{:<5}  max {:.3g} (id {})  rms {:.3g}  p95 {:.3g}  {}\n", type, d.max, d.worst_id, d.rms,
                              d.p95,
                              d.same ? std::string("within the tolerance") : fmt::format("{} differ", d.different));
}

std::string group_text(const AttributeDifference& d, std::size_t width)
{
    const std::string head = fmt::format("  {:<{}}  group  ", printable_name(d.name), width);
    return head + (d.same ? std::string("equal\n") : fmt::format("{} differ (id {} first)\n", d.different, d.worst_id));
}

// Returns the name of a type, or nothing if the set lacks the attribute.
std::optional<std::string> known(const std::string& type) { return type.empty() ? std::nullopt : std::optional(type); }

}  // namespace

std::string to_text(const Comparison& comparison)
{
    std::string text = fmt::format("{}: {} and {} points, {} compared, tolerance {:g} ({:.3g} m for P)\n",
                                   comparison.same ? "the same" : "different", comparison.points_a, comparison.points_b,
                                   comparison.compared, comparison.tolerance, comparison.tolerance_P);
    text += missing_text(comparison.only_a, "A") + missing_text(comparison.only_b, "B");
    std::size_t width = 4;
    for (const AttributeDifference& d : comparison.attributes) width = std::max(width, width_of(d.name));
    for (const AttributeDifference& d : comparison.groups) width = std::max(width, width_of(d.name));
    for (const AttributeDifference& d : comparison.attributes) text += attribute_text(d, width);
    for (const AttributeDifference& d : comparison.groups) text += group_text(d, width);
    return text;
}

std::string to_json(const Comparison& comparison)
{
    JsonText json;
    json.begin_object();
    json.members("same", comparison.same, "points", std::array{comparison.points_a, comparison.points_b}, "compared",
                 comparison.compared, "only_a", comparison.only_a, "only_b", comparison.only_b, "tolerance",
                 comparison.tolerance, "tolerance_P", comparison.tolerance_P);
    json.list("attributes", comparison.attributes, [&](const AttributeDifference& d) {
        json.object("name", d.name, "types", std::array{known(d.type_a), known(d.type_b)}, "max", d.max, "rms", d.rms,
                    "p95", d.p95, "worst_id", d.worst_id, "different", d.different, "same", d.same);
    });
    json.list("groups", comparison.groups, [&](const AttributeDifference& d) {
        json.object("name", d.name, "different", d.different, "same", d.same);
    });
    json.end();
    return json.text();
}

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

#include "bindings/host/testing/point_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace rapid {
namespace {

std::string text_of(const Numbers& numbers)
{
    if (numbers.count == 1) return fmt::format("{}", numbers.x[0]);
    return fmt::format("{{{}}}", fmt::join(numbers.x, numbers.x + numbers.count, ", "));
}

template <class T>
std::string text_of_value(const T& value)
{
    if constexpr (std::is_same_v<T, Token>)
        return fmt::format("\"{}\"", value.text());
    else
        return text_of(numbers_of(value));
}

std::string point_text(const TestedPoints& points, std::size_t place)
{
    return fmt::format("{}, point {} (id {})", points.source, place + 1, points.set.id()[place]);
}

// The first difference in the bits of two columns of one type, as a text.
std::optional<std::string> first_difference(const TestedPoints& a, const std::string& name, const AnyColumn& column_a,
                                            const AnyColumn& column_b)
{
    return std::visit(
        [&](const auto& values_a) -> std::optional<std::string> {
            const auto& values_b = std::get<std::decay_t<decltype(values_a)>>(column_b);
            for (std::size_t i = 0; i < values_a.size(); ++i)
                if (std::memcmp(&values_a[i], &values_b[i], sizeof values_a[i]) != 0)
                    return fmt::format("{}: {} is {} and {}", point_text(a, i), name, text_of_value(values_a[i]),
                                       text_of_value(values_b[i]));
            return std::nullopt;
        },
        column_a);
}

// Of sizes and names.
std::optional<std::string> first_difference_in_shape(const TestedPoints& a, const TestedPoints& b)
{
    if (a.set.size() != b.set.size())
        return fmt::format("{} has {} points and {} has {}", a.source, a.set.size(), b.source, b.set.size());
    if (a.set.column_names() != b.set.column_names())
        return fmt::format("{} has the attributes {} and {} has {}", a.source, fmt::join(a.set.column_names(), ", "),
                           b.source, fmt::join(b.set.column_names(), ", "));
    if (a.set.group_names() != b.set.group_names())
        return fmt::format("{} has the groups {} and {} has {}", a.source, fmt::join(a.set.group_names(), ", "),
                           b.source, fmt::join(b.set.group_names(), ", "));
    return std::nullopt;
}

}  // namespace

std::optional<std::string> first_not_finite(const TestedPoints& points)
{
    for (const auto& [name, any] : points.set.columns()) {
        std::optional<std::string> found = std::visit(
            [&, &attribute = name](const auto& column) -> std::optional<std::string> {
                for (std::size_t i = 0; i < column.size(); ++i) {
                    const Numbers numbers = numbers_of(column[i]);
                    // Infinity is the life of a point that never dies.
                    const bool life = attribute == "life";
                    if (std::all_of(numbers.x, numbers.x + numbers.count,
                                    [&](double x) { return std::isfinite(x) || (life && x > 0); }))
                        continue;
                    return fmt::format("{}: {} is {}", point_text(points, i), attribute, text_of(numbers));
                }
                return std::nullopt;
            },
            any);
        if (found) return found;
    }
    return std::nullopt;
}

std::optional<std::string> first_difference(const TestedPoints& a, const TestedPoints& b)
{
    if (auto found = first_difference_in_shape(a, b)) return found;
    for (const auto& [name, column] : a.set.columns()) {
        const AnyColumn& other = *b.set.find(name);
        if (type_of(column) != type_of(other))
            return fmt::format("{} is {} and {}", name, type_name(type_of(column)), type_name(type_of(other)));
        if (auto found = first_difference(a, name, column, other)) return found;
    }
    for (const auto& [name, members] : a.set.groups()) {
        const Column<std::uint8_t>& other = *b.set.find_group(name);
        for (std::size_t i = 0; i < members.size(); ++i)
            if (members[i] != other[i])
                return fmt::format("{}: {} in group {}", point_text(a, i), members[i] ? "only first" : "only second",
                                   name);
    }
    return std::nullopt;
}

}  // namespace rapid

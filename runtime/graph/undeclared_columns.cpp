#include "runtime/graph/undeclared_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <set>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

// A quiet NaN whose payload survives arithmetic, so that it can be recognized in results.
constexpr std::uint32_t poison_bits = 0x7fedbeefu;
const float poison_float = std::bit_cast<float>(poison_bits);

Token poison_token()
{
    static const Token poisoned = token_of("a value that is not declared");
    return poisoned;
}

template <class T>
T poison()
{
    if constexpr (std::is_same_v<T, float>)
        return poison_float;
    else if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f::Constant(poison_float);
    else if constexpr (std::is_same_v<T, Quatf>)
        return Quatf(poison_float, poison_float, poison_float, poison_float);
    else if constexpr (std::is_same_v<T, Token>)
        return poison_token();
    else if constexpr (sizeof(T) == 1)
        return T{0xa5};
    else
        return static_cast<T>(0x5eadbeef);
}

template <class T>
bool same_bits(const T& a, const T& b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <class T>
void poison(Column<T>& column)
{
    column = Column<T>(column.size(), poison<T>(), column.fallback());
}

// Adds attributes and, with group_prefix, groups.
void add_names(const Uses& uses, std::set<std::string>& names)
{
    for (const auto* list : {&uses.reads, &uses.writes, &uses.may, &uses.takes, &uses.gives})
        names.insert(list->begin(), list->end());
    for (const auto* list : {&uses.makes, &uses.defaults})
        for (const AttributeSpec& spec : *list) names.insert(spec.name);
    for (const auto* list : {&uses.reads_groups, &uses.takes_groups, &uses.makes_groups, &uses.joins_groups})
        for (const std::string& name : *list) names.insert(group_prefix + name);
}

// A mask of the original points that still exist, and their number.
struct Survivors {
    std::vector<std::uint8_t> mask;
    std::size_t count = 0;
};

Survivors survivors_of(const Column<std::int64_t>& before, const Column<std::int64_t>& after)
{
    Survivors survivors{std::vector<std::uint8_t>(before.size(), 0)};
    for (std::size_t i = 0; i < before.size() && survivors.count < after.size(); ++i)
        if (before[i] == after[survivors.count]) survivors.mask[i] = 1, ++survivors.count;
    return survivors;
}

template <class T>
void restore_values(const std::string& name, const Column<T>& before, const Survivors& survivors, Column<T>& column)
{
    for (std::size_t i = 0; i < survivors.count; ++i)
        if (!same_bits(column[i], poison<T>()))
            throw Error(fmt::format("it writes \"{}\", which it does not declare", name));
    Column<T> restored = before;
    restored.set_fallback(column.fallback());
    restored.keep(Compaction::from_mask(survivors.mask));
    for (std::size_t i = survivors.count; i < column.size(); ++i) restored.append(1, column[i]);
    column = std::move(restored);
}

bool is_poisoned(const AnyColumn& any)
{
    const auto holds = [](const auto& column, const auto& poisoned) {
        for (std::size_t i = 0; i < column.size(); ++i)
            if (poisoned(column[i])) return true;
        return false;
    };
    const auto is_poison = [](float x) { return std::bit_cast<std::uint32_t>(std::abs(x)) == poison_bits; };
    if (const auto* floats = std::get_if<Column<float>>(&any)) return holds(*floats, is_poison);
    if (const auto* vectors = std::get_if<Column<Vec3f>>(&any))
        return holds(*vectors, [&](const Vec3f& x) { return is_poison(x[0]) || is_poison(x[1]) || is_poison(x[2]); });
    if (const auto* strings = std::get_if<Column<Token>>(&any))
        return holds(*strings, [](Token x) { return x == poison_token(); });
    return false;
}

}  // namespace

UndeclaredColumns::UndeclaredColumns(PointSet& points, std::span<const Uses> declared) : ids_(points.id())
{
    const std::vector<std::string> own = point_names_of(PointName::OwnColumn);
    std::set<std::string> names(own.begin(), own.end());
    for (const Uses& uses : declared) {
        if (uses.reads_all) return;
        add_names(uses, names);
    }
    for (const std::string& name : points.column_names()) {
        if (names.count(name)) continue;
        AnyColumn& column = *points.find(name);
        columns_.emplace(name, column);
        std::visit([](auto& values) { poison(values); }, column);
    }
    for (const std::string& name : points.group_names()) {
        if (names.count(group_prefix + name)) continue;
        groups_.emplace(name, points.group(name));
        poison(points.group(name));
    }
}

void UndeclaredColumns::restore(PointSet& points) const
{
    const Survivors survivors = survivors_of(ids_, points.id());
    for (const auto& [name, before] : columns_) {
        AnyColumn* after = points.find(name);
        if (!after || after->index() != before.index())
            throw Error(fmt::format("it removes \"{}\", which it does not declare", name));
        std::visit(
            [&, &name = name, &before = before](auto& column) {
                restore_values(name, std::get<std::remove_cvref_t<decltype(column)>>(before), survivors, column);
            },
            *after);
    }
    for (const auto& [name, before] : groups_) {
        if (!points.find_group(name))
            throw Error(fmt::format("it removes the group \"{}\", which it does not declare", name));
        restore_values(name, before, survivors, points.group(name));
    }
    for (const auto& [name, column] : points.columns())
        if (!columns_.count(name) && is_poisoned(column))
            throw Error(fmt::format("it reads a column that it does not declare: \"{}\" depends on it", name));
}

}  // namespace rapid

#include "bindings/host/test_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <lua.hpp>
#include <optional>
#include <string>
#include <unordered_map>

#include "runtime/error.h"

namespace rapid {
namespace {

constexpr const char* metatable = "rapid.points";

struct Points {
    PointSet set;
    std::string source;
    std::unordered_map<std::int64_t, std::size_t> places;  // by id; made when first asked for
};

Points& points_at(lua_State* L, int index) { return **static_cast<Points**>(luaL_checkudata(L, index, metatable)); }

std::string text_at(lua_State* L, int index)
{
    std::size_t size = 0;
    const char* text = luaL_checklstring(L, index, &size);
    return {text, size};
}

// Turns an Error into a Lua error with exactly its text.
template <int (*function)(lua_State*)>
int guarded(lua_State* L)
{
    try {
        return function(L);
    } catch (const Error& error) {
        lua_pushstring(L, error.what());
    }
    return lua_error(L);
}

// A value as its numbers: 1, 3 (vec3) or 4 (quaternion, x y z w).
struct Numbers {
    int count = 1;
    double x[4] = {};
};
Numbers numbers_of(const Vec3f& v) { return {3, {v.x(), v.y(), v.z()}}; }
Numbers numbers_of(const Quatf& q) { return {4, {q.x(), q.y(), q.z(), q.w()}}; }
template <class T>
Numbers numbers_of(T value)
{
    return {1, {static_cast<double>(value)}};
}

int push(lua_State* L, const Numbers& numbers)
{
    for (int k = 0; k < numbers.count; ++k) lua_pushnumber(L, numbers.x[k]);
    return numbers.count;
}

const AnyColumn& column_of(const Points& points, const std::string& name)
{
    if (const AnyColumn* column = points.set.find(name)) return *column;
    throw Error(fmt::format("{} has no attribute \"{}\"{}", points.source, name,
                            did_you_mean(name, points.set.column_names())));
}

int size(lua_State* L)
{
    lua_pushinteger(L, static_cast<lua_Integer>(points_at(L, 1).set.size()));
    return 1;
}

int source(lua_State* L)
{
    lua_pushstring(L, points_at(L, 1).source.c_str());
    return 1;
}

int names(lua_State* L)
{
    lua_newtable(L);
    int i = 0;
    for (const std::string& name : points_at(L, 1).set.column_names()) {
        lua_pushstring(L, name.c_str());
        lua_rawseti(L, -2, ++i);
    }
    return 1;
}

int group_names(lua_State* L)
{
    lua_newtable(L);
    int i = 0;
    for (const std::string& name : points_at(L, 1).set.group_names()) {
        lua_pushstring(L, name.c_str());
        lua_rawseti(L, -2, ++i);
    }
    return 1;
}

// value(points, place from 1, name): the numbers of the value.
int value(lua_State* L)
{
    const Points& points = points_at(L, 1);
    const auto place = static_cast<std::size_t>(luaL_checkinteger(L, 2)) - 1;
    return std::visit([&](const auto& column) { return push(L, numbers_of(column[place])); },
                      column_of(points, text_at(L, 3)));
}

const Column<std::uint8_t>& group_of(const Points& points, const std::string& name)
{
    if (const Column<std::uint8_t>* group = points.set.find_group(name)) return *group;
    throw Error(
        fmt::format("{} has no group \"{}\"{}", points.source, name, did_you_mean(name, points.set.group_names())));
}

// within(points, place from 1, group)
int within(lua_State* L)
{
    const auto place = static_cast<std::size_t>(luaL_checkinteger(L, 2)) - 1;
    lua_pushboolean(L, group_of(points_at(L, 1), text_at(L, 3))[place] != 0);
    return 1;
}

// place_of(points, id): from 1; nil where no point has the id.
int place_of(lua_State* L)
{
    Points& points = points_at(L, 1);
    if (points.places.empty())
        for (std::size_t i = 0; i < points.set.size(); ++i) points.places.emplace(points.set.id()[i], i);
    const auto found = points.places.find(static_cast<std::int64_t>(luaL_checknumber(L, 2)));
    if (found == points.places.end()) return 0;
    lua_pushinteger(L, static_cast<lua_Integer>(found->second) + 1);
    return 1;
}

int group(lua_State* L)
{
    const Points& points = points_at(L, 1);
    const std::string name = text_at(L, 2);
    const Column<std::uint8_t>& members = group_of(points, name);
    std::vector<std::uint8_t> mask(points.set.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = members[i];
    PointSet subset = points.set;
    subset.keep(mask);
    push_points(L, std::move(subset), fmt::format("{}, group {}", points.source, name));
    return 1;
}

// reduce(points, name, "min" | "max" | "mean"), for each number of the values. A NaN among them makes the result NaN:
// no comparison with it holds, so no test overlooks it. Of no points: inf, -inf and NaN.
int reduce(lua_State* L)
{
    const std::string what = text_at(L, 3);
    const double start = what == "min"   ? std::numeric_limits<double>::infinity()
                         : what == "max" ? -std::numeric_limits<double>::infinity()
                                         : 0;
    return std::visit(
        [&](const auto& column) {
            Numbers result = numbers_of(std::decay_t<decltype(column)>::zero());
            std::fill_n(result.x, result.count, start);
            for (std::size_t i = 0; i < column.size(); ++i) {
                const Numbers numbers = numbers_of(column[i]);
                for (int k = 0; k < result.count; ++k) {
                    double& so_far = result.x[k];
                    const double x = numbers.x[k];
                    if (std::isnan(x) || std::isnan(so_far))
                        so_far = std::numeric_limits<double>::quiet_NaN();
                    else
                        so_far = what == "min" ? std::min(so_far, x) : what == "max" ? std::max(so_far, x) : so_far + x;
                }
            }
            if (what == "mean")
                for (int k = 0; k < result.count; ++k) result.x[k] /= static_cast<double>(column.size());
            return push(L, result);
        },
        column_of(points_at(L, 1), text_at(L, 2)));
}

std::string text_of(const Numbers& numbers)
{
    if (numbers.count == 1) return fmt::format("{}", numbers.x[0]);
    return fmt::format("{{{}}}", fmt::join(numbers.x, numbers.x + numbers.count, ", "));
}

std::string point_text(const Points& points, std::size_t place)
{
    return fmt::format("{}, point {} (id {})", points.source, place + 1, points.set.id()[place]);
}

// not_finite(points): what is not, or nil.
int not_finite(lua_State* L)
{
    const Points& points = points_at(L, 1);
    for (const auto& [name, any] : points.set.columns()) {
        const std::optional<std::string> found = std::visit(
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
        if (!found) continue;
        lua_pushstring(L, found->c_str());
        return 1;
    }
    return 0;
}

// The first difference in the bits of two columns of one type, as a text.
std::optional<std::string> first_difference(const Points& a, const std::string& name, const AnyColumn& column_a,
                                            const AnyColumn& column_b)
{
    return std::visit(
        [&](const auto& values_a) -> std::optional<std::string> {
            const auto& values_b = std::get<std::decay_t<decltype(values_a)>>(column_b);
            for (std::size_t i = 0; i < values_a.size(); ++i)
                if (std::memcmp(&values_a[i], &values_b[i], sizeof values_a[i]) != 0)
                    return fmt::format("{}: {} is {} and {}", point_text(a, i), name, text_of(numbers_of(values_a[i])),
                                       text_of(numbers_of(values_b[i])));
            return std::nullopt;
        },
        column_a);
}

std::optional<std::string> first_difference(const Points& a, const Points& b)
{
    if (a.set.size() != b.set.size())
        return fmt::format("{} has {} points and {} has {}", a.source, a.set.size(), b.source, b.set.size());
    if (a.set.column_names() != b.set.column_names())
        return fmt::format("{} has the attributes {} and {} has {}", a.source, fmt::join(a.set.column_names(), ", "),
                           b.source, fmt::join(b.set.column_names(), ", "));
    if (a.set.group_names() != b.set.group_names())
        return fmt::format("{} has the groups {} and {} has {}", a.source, fmt::join(a.set.group_names(), ", "),
                           b.source, fmt::join(b.set.group_names(), ", "));
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

// difference(a, b): the first one in their bits, or nil.
int difference(lua_State* L)
{
    const std::optional<std::string> found = first_difference(points_at(L, 1), points_at(L, 2));
    if (!found) return 0;
    lua_pushstring(L, found->c_str());
    return 1;
}

int collect(lua_State* L)
{
    delete &points_at(L, 1);
    return 0;
}

}  // namespace

void push_points(lua_State* L, PointSet points, std::string source)
{
    auto* place = static_cast<Points**>(lua_newuserdata(L, sizeof(Points*)));
    *place = new Points{std::move(points), std::move(source), {}};
    luaL_getmetatable(L, metatable);
    lua_setmetatable(L, -2);
}

void register_points(lua_State* L)
{
    const luaL_Reg functions[] = {{"size", guarded<size>},
                                  {"source", guarded<source>},
                                  {"names", guarded<names>},
                                  {"group_names", guarded<group_names>},
                                  {"value", guarded<value>},
                                  {"within", guarded<within>},
                                  {"place_of", guarded<place_of>},
                                  {"group", guarded<group>},
                                  {"reduce", guarded<reduce>},
                                  {"not_finite", guarded<not_finite>},
                                  {"difference", guarded<difference>}};
    for (const luaL_Reg& function : functions) {
        lua_pushcfunction(L, function.func);
        lua_setfield(L, -2, function.name);
    }
    luaL_newmetatable(L, metatable);
    lua_pushcfunction(L, collect);
    lua_setfield(L, -2, "__gc");
    lua_pushcfunction(L, guarded<size>);
    lua_setfield(L, -2, "__len");
    lua_setfield(L, -2, "points_metatable");
}

}  // namespace rapid

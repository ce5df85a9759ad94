#include "runtime/operators/births/newborn.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "runtime/points/attribute_like.h"

namespace rapid {

void read_value(const Param& param, const Value& value, Interval& field)
{
    const Table* table = value.table();
    if (!table) {
        if (!value.get<double>()) wrong_type(param, value);
        read_value(param, value, field.min);
        field.max = field.min;
        return;
    }
    if (table->list.size() != 2 || !table->list[0].get<double>() || !table->list[1].get<double>())
        wrong_type(param, value);
    read_value(param, table->list[0], field.min);
    read_value(param, table->list[1], field.max);
    if (field.min > field.max)
        throw Error(fmt::format("{} = {} is in the wrong order; it must be {{min, max}}", param.name, describe(value)));
    if (std::isinf(field.max) && !field.is_single())
        throw Error(fmt::format("{} = {} has no mean; both must be finite", param.name, describe(value)));
}

std::string describe(const Interval& interval)
{
    return interval.is_single() ? fmt::format("{}", interval.min)
                                : fmt::format("{{{}, {}}}", interval.min, interval.max);
}

void read_value(const Param& param, const Value& value, BirthMoment& field)
{
    field = {};
    field.function = value.object<PointFunction>();
    if ((field.edit = std::dynamic_pointer_cast<const PointEditor>(field.function))) return;
    if (!value.get<std::string>()) wrong_type(param, value);
    read_value(param, value, field.when);
}

void Newborn::use_newborn(Uses& uses) const
{
    uses.gives.insert(uses.gives.end(), {"age", "birthtime"});
    if (life && (may_end() || uses.functions.count("life"))) uses.gives.push_back("life");
    if (!joins.empty()) uses.makes_groups.push_back(joins);
    if (birth.edit) birth.function->uses(uses);
}

void Newborn::check_attributes() const
{
    for (const auto& [name, value] : attributes.of)
        for (const auto& [own, remedy] : {std::pair{"age", "use the parameter age"},
                                          {"life", "use the parameter life"},
                                          {"birthtime", "Rapid sets it to the time of birth if something reads it"}})
            if (name == own) throw Error(fmt::format("attributes: \"{}\" can't be given; {}", name, remedy));
}

std::vector<AttributeSpec> Newborn::given() const
{
    std::vector<AttributeSpec> specs;
    for (const auto& [name, value] : attributes.of) specs.push_back(attribute_like(name, value.first()));
    return specs;
}

std::optional<std::vector<float>> Newborn::common_value(const std::string& attribute) const
{
    const auto found = attributes.of.find(attribute);
    if (found == attributes.of.end() || !found->second.is_common()) return std::nullopt;
    const auto* number = std::get_if<float>(&found->second.first());
    return number ? std::optional(std::vector{*number}) : std::nullopt;
}

std::vector<DrawValues> Newborn::draws_of(PointSet& points, std::size_t n, const Evaluation& now) const
{
    std::vector<DrawValues> draws;
    for (const auto& [name, value] : attributes.of)
        if (!value.is_common() && now.keeps(name))
            draws.push_back(draw_values(value, *points.find(name), n, now.random, name));
    return draws;
}

namespace {

// The low half of the use, which no other draw of an emitter has (draws.h); the high half depends on the name.
constexpr std::uint64_t attribute_use = 24;

bool is_list(const Value& value, std::size_t size)
{
    const Table* table = value.table();
    return table && table->list.size() == size && table->numbered.empty() && table->named.empty();
}

// Recognizes {{0, value}, {1, value}}: each entry is a list of a number and a value.
bool is_ramp(const Table& table)
{
    if (table.list.size() < 2) return false;
    for (const Value& entry : table.list)
        if (!is_list(entry, 2) || !entry.table()->list[0].get<double>()) return false;
    return true;
}

// Recognizes {min, max}: two numbers, or two vectors.
bool is_range(const Table& table)
{
    if (table.list.size() != 2) return false;
    const auto vector = [](const Value& value) { return value.get<Vec3d>() || is_list(value, 3); };
    return (table.list[0].get<double>() && table.list[1].get<double>()) ||
           (vector(table.list[0]) && vector(table.list[1]));
}

bool is_choice(const Table& table)
{
    const auto is_text = [](const Value& value) { return value.get<std::string>() != nullptr; };
    return !table.list.empty() && table.numbered.empty() && table.named.empty() &&
           std::all_of(table.list.begin(), table.list.end(), is_text);
}

AttributeValue read_one(const Param& param, const Value& value)
{
    AttributeValue read;
    read_value(param, value, read);
    return read;
}

BirthValue read_ramp(const Param& param, const Table& table)
{
    BirthValue result;
    for (const Value& entry : table.list) {
        const double at = *entry.table()->list[0].get<double>();
        if (!(at >= 0 && at <= 1) || (!result.keys.empty() && at <= result.keys.back().at))
            throw Error(fmt::format("{}: a key of the ramp is at {}; keys must increase from 0 to 1", param.name, at));
        result.keys.push_back({at, read_one(param, entry.table()->list[1])});
        if (std::holds_alternative<Token>(result.first()))
            throw Error(
                fmt::format("{}: strings can't be interpolated; to choose one at random, give a list: {{\"a\", \"b\"}}",
                            param.name));
        if (result.keys.back().value.index() != result.first().index())
            throw Error(fmt::format("{}: the keys of the ramp have values of different types; give all the same type",
                                    param.name));
    }
    return result;
}

BirthValue read_birth_value(const Param& param, const Value& value)
{
    const Table* table = value.table();
    if (table && is_ramp(*table)) return read_ramp(param, *table);
    if (table && is_choice(*table)) {
        BirthValue result;
        for (const Value& text : table->list) result.keys.push_back({0, read_one(param, text)});
        return result;
    }
    if (!table || !is_range(*table)) return {{{0, read_one(param, value)}}};
    BirthValue result{{{0, read_one(param, table->list[0])}, {1, read_one(param, table->list[1])}}};
    if (const auto* low = std::get_if<std::int32_t>(&result.first())) {
        result.counts = true;
        if (*low > std::get<std::int32_t>(result.keys[1].value))
            throw Error(
                fmt::format("{} = {} is in the wrong order; it must be {{min, max}}", param.name, describe(value)));
    }
    return result;
}

// Returns the use of the number that a birth draws for an attribute.
std::uint64_t use_of(std::string_view name)
{
    std::uint64_t hash = 14695981039346656037ull;  // FNV-1a
    for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
    return hash << 32 | attribute_use;
}

}  // namespace

void read_value(const Param& param, const Value& value, BirthValues& field)
{
    field.of.clear();
    if (value.is_nil()) return;
    const Table* table = value.table();
    if (!table || !table->numbered.empty()) wrong_type(param, value);
    if (!table->list.empty())
        throw Error(fmt::format("{}: {} has no name; write {{ NAME = value, ... }}, and numbers without a comma",
                                param.name, describe(table->list.front())));
    for (const auto& [name, given] : table->named) {
        Param one = param;
        one.name = name;
        field.of[name] = read_birth_value(one, given);
    }
}

DrawValues draw_values(const BirthValue& value, AnyColumn& column, std::size_t n, RandomKey key, std::string_view name)
{
    return std::visit(
        [&]<class T>(Column<T>& own) -> DrawValues {
            return [&value, key, use = use_of(name), to = own.write().last(n)](std::size_t first, std::size_t count,
                                                                               const Items& births) {
                std::array<std::array<double, 4>, 64> u;
                for (std::size_t i = 0; i < count; i += u.size()) {
                    const std::size_t part = std::min(u.size(), count - i);
                    uniform4(key, births.from(i), use, std::span(u).first(part));
                    for (std::size_t j = 0; j < part; ++j) to[first + i + j] = value.at<T>(u[j][0]);
                }
            };
        },
        column);
}

}  // namespace rapid

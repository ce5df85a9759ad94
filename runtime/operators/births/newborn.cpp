#include "runtime/operators/births/newborn.h"

#include <fmt/format.h>

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

}  // namespace rapid

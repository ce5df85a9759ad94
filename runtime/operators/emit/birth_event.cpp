#include "runtime/operators/emit/birth_event.h"

#include <fmt/format.h>

#include <cstdlib>
#include <regex>

namespace rapid {
namespace {

std::optional<AttributeComparison> comparison_of(const std::string& text)
{
    static const std::regex form(R"(\s*([A-Za-z_]\w*)(?:\.([xyz]))?\s*(<=|>=|<|>)\s*([-+.\w]+)\s*)");
    std::smatch part;
    if (!std::regex_match(text, part, form)) return std::nullopt;
    AttributeComparison comparison;
    comparison.attribute = part[1];
    if (part[2].matched) comparison.axis = *part[2].first - 'x';
    comparison.relation = part[3] == "<"    ? AttributeComparison::Below
                          : part[3] == "<=" ? AttributeComparison::AtMost
                          : part[3] == ">"  ? AttributeComparison::Above
                                            : AttributeComparison::AtLeast;
    const std::string number = part[4];
    char* end = nullptr;
    comparison.limit = std::strtod(number.c_str(), &end);
    if (*end != '\0' || !std::isfinite(comparison.limit)) return std::nullopt;
    return comparison;
}

}  // namespace

void BirthEvent::uses(Uses& uses) const
{
    if (kind == Compares) uses.reads_of_source.push_back(comparison.attribute);
    if (kind != Tests) return;
    Uses own;
    test->uses(own);
    const auto append = [](std::vector<std::string>& to, const std::vector<std::string>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    append(uses.reads_of_source, own.reads);
    append(uses.takes_of_source, own.may);
    append(uses.reads_groups_of_source, own.reads_groups);
}

void read_value(const Param& param, const Value& value, BirthEvent& field)
{
    field = {};
    if (const auto test = value.object<PointFunction>()) {
        field.kind = BirthEvent::Tests;
        field.test = test;
        return;
    }
    const std::string* text = value.get<std::string>();
    if (text && (*text == "hit" || *text == "death" || *text == "birth")) {
        field.kind = *text == "hit" ? BirthEvent::Hit : *text == "death" ? BirthEvent::Death : BirthEvent::Birth;
        return;
    }
    const std::optional<AttributeComparison> comparison = text ? comparison_of(*text) : std::nullopt;
    if (!comparison)
        throw Error(
            fmt::format("{} = {} is no event; it must be \"hit\", \"death\", \"birth\", a comparison of an "
                        "attribute with a number (\"age > 0.5\", \"P.y < 0\"), or a function of a point",
                        param.name, describe(value)));
    field.kind = BirthEvent::Compares;
    field.comparison = *comparison;
}

}  // namespace rapid

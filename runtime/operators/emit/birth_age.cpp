#include "runtime/operators/emit/birth_age.h"

#include <fmt/format.h>

#include <cmath>

namespace rapid {
namespace {

std::optional<double> common_age(const std::optional<BirthAge>& age, const std::string& birth, double h)
{
    if (age) return age->is_single() ? std::optional(age->interval.min) : std::nullopt;
    if (h == 0 || birth == "end") return 0.0;
    if (birth == "begin") return h;
    return std::nullopt;
}

}  // namespace

void read_value(const Param& param, const Value& value, BirthAge& field)
{
    if (const auto* reference = value.get<AttributeRef>())
        field = {{}, reference->name};
    else
        read_value(param, value, field.interval), field.attribute.clear();
}

void BirthAge::check(const BirthSource& source) const
{
    if (attribute.empty()) return;
    const AnyColumn* column = source.values().find(attribute);
    const auto* ages = column ? std::get_if<Column<float>>(column) : nullptr;
    if (!ages) {
        const std::string near = did_you_mean(attribute, source.values().column_names());
        throw Error(fmt::format("age = rapid.attr \"{}\": the source has no float of that name{}", attribute,
                                near.empty() ? "; give the source one, or a number" : near));
    }
    for (std::size_t i = 0; i < ages->size(); ++i)
        if (!((*ages)[i] >= 0) || std::isinf((*ages)[i]))
            throw Error(fmt::format("age = rapid.attr \"{}\": the source's point {} has {}; ages are at least 0",
                                    attribute, i, (*ages)[i]));
}

BirthAges::BirthAges(const std::optional<BirthAge>& age, const std::string& birth, const BirthSource& source,
                     double frame_length)
    : age_(age),
      source_(source),
      h_(frame_length),
      even_(birth == "even"),
      common_(common_age(age, birth, frame_length))
{
}

void BirthAges::find(const Births& births, const Items& places_in_frame, std::span<const Birthplace> places,
                     std::span<const Draws> draws, std::span<double> L) const
{
    const AnyColumn* own = age_ && !age_->attribute.empty() ? source_.values().find(age_->attribute) : nullptr;
    for (std::size_t i = 0; i < L.size(); ++i) {
        if (common_)
            L[i] = *common_;
        else if (own)
            L[i] = static_cast<double>(source_.value(std::get<Column<float>>(*own).read(), places[i]));
        else if (age_)
            L[i] = age_->interval.at(draws[i][age_draw]);
        else
            L[i] = even_ ? births.even_age(places_in_frame[i]) : h_ * draws[i][age_draw];
    }
}

}  // namespace rapid

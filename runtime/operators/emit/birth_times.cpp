#include "runtime/operators/emit/birth_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

double snapped(double births)
{
    const double whole = std::round(births);
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * births;
    return std::abs(births - whole) <= std::max(whole_tolerance, rounding) ? whole : births;
}

std::optional<double> common_age(const std::optional<BirthAge>& age, const std::string& birth, double h)
{
    if (age) return age->is_single() ? std::optional(age->interval.min) : std::nullopt;
    if (h == 0 || birth == "end") return 0.0;
    if (birth == "begin") return h;
    return std::nullopt;
}

}  // namespace

// Birth i takes place at the time t with per_second (t - t0) = i + 1; at the frame's end the left side is `due`.
double Births::even_age(std::size_t i) const { return std::max(0.0, (due - static_cast<double>(i + 1)) / per_second); }

double BirthClock::due_by(std::int64_t frame, double fps) const
{
    return snapped(carry_ + rate_ * static_cast<double>(frame - anchor_) / fps);
}

Births BirthClock::at_rate(double rate, std::int64_t frame, double fps)
{
    if (rate != rate_) {
        carry_ = due_by(frame - 1, fps) - static_cast<double>(born_);
        anchor_ = frame - 1;
        born_ = 0;
        rate_ = rate;
    }
    const double at_end = due_by(frame, fps);
    const double before = static_cast<double>(born_), count = std::floor(at_end) - before;
    StateReader::expect(is_between(count, 0, max_births));
    Births births = at_once(static_cast<std::size_t>(count), fps);
    births.due = at_end - before;
    births.per_second = rate;
    born_ += births.count;
    return births;
}

Births BirthClock::at_once(std::size_t count, double fps, int part, int parts)
{
    const auto n = static_cast<std::size_t>(parts), k = static_cast<std::size_t>(part);
    const std::size_t before = count * k / n, born = count * (k + 1) / n - before;
    const double due = static_cast<double>(count * (k + 1)) / parts - static_cast<double>(before);
    const Births births{total_, born, due, static_cast<double>(count) * fps};
    total_ += born;
    return births;
}

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
        throw Error(fmt::format("age = rapid.attr \"{}\": the source has no float with this name{}", attribute,
                                near.empty() ? "; give the source this attribute, or give age a number" : near));
    }
    for (std::size_t i = 0; i < ages->size(); ++i)
        if (!((*ages)[i] >= 0) || std::isinf((*ages)[i]))
            throw Error(fmt::format("age = rapid.attr \"{}\": point {} of the source has {}; an age must be at least 0",
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

void BirthAges::find(const Births& births, const Items& indices_in_frame, std::span<const Birthplace> birthplaces,
                     std::span<const Draws> draws, std::span<double> L) const
{
    const AnyColumn* own = age_ && !age_->attribute.empty() ? source_.values().find(age_->attribute) : nullptr;
    for (std::size_t i = 0; i < L.size(); ++i) {
        if (common_)
            L[i] = *common_;
        else if (own)
            L[i] = static_cast<double>(source_.value(std::get<Column<float>>(*own).read(), birthplaces[i]));
        else if (age_)
            L[i] = age_->interval.at(draws[i][age_draw]);
        else
            L[i] = even_ ? births.even_age(indices_in_frame[i]) : h_ * draws[i][age_draw];
    }
}

}  // namespace rapid

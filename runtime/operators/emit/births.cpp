#include "runtime/operators/emit/births.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/points/state_checks.h"

namespace rapid {
namespace {

double snapped(double births)
{
    const double whole = std::round(births);
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * births;
    return std::abs(births - whole) <= std::max(whole_tolerance, rounding) ? whole : births;
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
    StateReader::expect(is_between(count, 0, most_births));
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

}  // namespace rapid

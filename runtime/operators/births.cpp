#include "runtime/operators/births.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rapid {
namespace {

// How near to a whole number of births the number due counts as that number, in births. 0.29 births a second for 100 s
// is 28.999999999999996 in doubles, and 29 to whoever wrote it. Rounding is below 1e-11 here after 100,000 changes of
// the rate, and a birth is shifted by at most this fraction of the time between two.
constexpr double whole_within = 1e-9;

double snapped(double births)
{
    const double whole = std::round(births);
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * births;
    return std::abs(births - whole) <= std::max(whole_within, rounding) ? whole : births;
}

}  // namespace

// Birth i is due when i + 1 births are: per_second (t - t0) = i + 1 at its time t, and `reached` at the frame's end.
double Births::even_age(std::size_t i) const
{
    return std::max(0.0, (reached - static_cast<double>(i + 1)) / per_second);
}

double BirthClock::due(std::int64_t frame, double fps) const
{
    return snapped(carry_ + rate_ * static_cast<double>(frame - anchor_) / fps);
}

Births BirthClock::at_rate(double rate, std::int64_t frame, double fps)
{
    if (rate != rate_) {
        carry_ = due(frame - 1, fps) - static_cast<double>(borne_);
        anchor_ = frame - 1;
        borne_ = 0;
        rate_ = rate;
    }
    const double at_end = due(frame, fps);
    const double before = static_cast<double>(borne_);
    Births births = at_once(static_cast<std::size_t>(std::floor(at_end) - before), fps);
    births.reached = at_end - before;
    births.per_second = rate;
    borne_ += births.count;
    return births;
}

Births BirthClock::at_once(std::size_t count, double fps, int part, int parts)
{
    const auto n = static_cast<std::size_t>(parts), k = static_cast<std::size_t>(part);
    const std::size_t before = count * k / n, born = count * (k + 1) / n - before;
    const double reached = static_cast<double>(count * (k + 1)) / parts - static_cast<double>(before);
    const Births births{total_, born, reached, static_cast<double>(count) * fps};
    total_ += born;
    return births;
}

}  // namespace rapid

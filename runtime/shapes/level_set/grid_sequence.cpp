#include "runtime/shapes/level_set/grid_sequence.h"

namespace rapid {
namespace {

// The remainder that is at least 0.
std::int64_t modulo(std::int64_t x, std::int64_t period) { return (x % period + period) % period; }

}  // namespace

std::optional<int> SequenceFiles::frame_of(std::int64_t frame) const
{
    const std::int64_t first = files.begin()->first, last = files.rbegin()->first, at = frame - offset;
    if (at >= first && at <= last) return static_cast<int>(at);
    const std::int64_t length = last - first;
    switch (at < first ? before : after) {
        case Outside::Nothing:
            return std::nullopt;
        case Outside::Repeat:  // the first file comes a frame after the last
            return static_cast<int>(first + modulo(at - first, length + 1));
        case Outside::Mirror: {
            const std::int64_t way = length == 0 ? 0 : modulo(at - first, 2 * length);
            return static_cast<int>(first + (way > length ? 2 * length - way : way));
        }
        case Outside::Hold:
            break;
    }
    return static_cast<int>(at < first ? first : last);
}

SequenceFiles::Interval SequenceFiles::interval(std::int64_t frame) const
{
    const std::optional<int> from = frame_of(frame), to = frame_of(frame + 1);
    if (!from || !to) {  // from nothing, or to nothing: what holds is a file, at an end of the sequence
        return {from, to, 0, 1};
    }
    const int low = std::min(*from, *to), high = std::max(*from, *to);
    if (high - low > 1) return {*from, *to, 0, 1};  // from the last to the first
    const int a = std::prev(files.upper_bound(low))->first, b = files.lower_bound(high)->first;
    const auto part = [&](int at) { return a == b ? 0 : static_cast<double>(at - a) / (b - a); };
    return {a, b, part(*from), part(*to)};
}

}  // namespace rapid

#include "runtime/shapes/level_set/grid_sequence.h"

namespace rapid {

std::optional<int> SequenceFiles::frame_of(std::int64_t frame) const
{
    FrameSequence sequence = order;
    sequence.first = files.begin()->first;
    sequence.last = files.rbegin()->first;
    const std::optional<std::int64_t> file = sequence.file_of(frame);
    if (!file) return std::nullopt;
    return static_cast<int>(*file);
}

SequenceFiles::Interval SequenceFiles::interval(std::int64_t frame) const
{
    const std::optional<int> from = frame_of(frame), to = frame_of(frame + 1);
    if (!from || !to) {  // the sequence begins or ends here: no interpolation towards nothing
        return {from, to, 0, 1};
    }
    const int low = std::min(*from, *to), high = std::max(*from, *to);
    if (high - low > 1) return {*from, *to, 0, 1};  // the sequence wraps from its last frame to its first
    const int a = std::prev(files.upper_bound(low))->first, b = files.lower_bound(high)->first;
    const auto part = [&](int at) { return a == b ? 0 : static_cast<double>(at - a) / (b - a); };
    return {a, b, part(*from), part(*to)};
}

}  // namespace rapid

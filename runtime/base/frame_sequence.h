// Maps frames to the files of a sequence.
//
// A sequence has a file for each integer from `first` to `last`. Frame f uses the file f - offset. Beyond the ends, the
// first or last file holds, the files repeat, they play back and forth, or there is no file.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

namespace rapid {

struct FrameSequence {
    enum Beyond { Hold, Repeat, Mirror, None };

    std::int64_t first = 1, last = 1;
    Beyond before = Hold, after = Hold;
    std::int64_t offset = 0;  // frames by which the files are delayed

    // Returns the file of a frame, or nothing if there is none.
    std::optional<std::int64_t> file_of(std::int64_t frame) const
    {
        const std::int64_t file = frame - offset;
        if (file >= first && file <= last) return file;
        const std::int64_t n = last - first + 1;
        const auto place = [&](std::int64_t period) { return ((file - first) % period + period) % period; };
        switch (file < first ? before : after) {
            case Hold:
                return file < first ? first : last;
            case Repeat:
                return first + place(n);
            case Mirror: {
                if (n == 1) return first;
                const std::int64_t at = place(2 * n - 2);  // each end occurs once
                return first + (at < n ? at : 2 * n - 2 - at);
            }
            case None:
                break;
        }
        return std::nullopt;
    }

    // Return the range of frames in which the file may change.
    double begins() const { return is_endless(before) ? -infinite : static_cast<double>(first + offset); }
    double ends() const { return is_endless(after) ? infinite : static_cast<double>(last + offset); }

private:
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    static bool is_endless(Beyond beyond) { return beyond == Repeat || beyond == Mirror; }
};

}  // namespace rapid

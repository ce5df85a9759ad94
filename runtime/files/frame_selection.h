// A selection of frames from a sequence: first, last and step.
#pragma once

#include <cstdint>

namespace rapid {

struct FrameSelection {
    std::int64_t first, last, step = 1;

    bool contains(std::int64_t frame) const { return frame >= first && frame <= last && (frame - first) % step == 0; }
    bool single() const { return first + step > last; }
};

}  // namespace rapid

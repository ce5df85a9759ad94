// The frames of -f.
#pragma once

#include <cstdint>
#include <string>

namespace rapid {

// Without -f: two seconds at 24 frames a second.
constexpr std::int64_t default_frames = 48;

// -f 1-48, 1-48x2, 12. All frames from the scene's first one are computed; these are written.
struct FrameSelection {
    std::int64_t first, last, step = 1;

    bool contains(std::int64_t frame) const { return frame >= first && frame <= last && (frame - first) % step == 0; }
    bool single() const { return first + step > last; }
};

// Error: the text is not of this form.
FrameSelection read_frames(const std::string& text);

}  // namespace rapid

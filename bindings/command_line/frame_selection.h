// Parses the frames of -f.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "bindings/command_line/options.h"
#include "include/rapid/run.h"

namespace rapid {

// Default without -f: two seconds at 24 frames a second.
constexpr std::int64_t default_frames = 48;

// Parses 1-48, 1-48x2, 12. All frames from the scene's first one are computed; these are written. Throws Error if the
// text does not have this form.
RunFrames read_frames(const std::string& text);

// Parses one frame, for another option. Throws Error unless the text is a whole number of 32 bits.
std::int64_t read_frame(const std::string& option, const std::string& text);

// Declares -f. doc: the meaning of the frames, and the default.
void declare_frames(Options& options, std::optional<RunFrames>& frames, const std::string& doc);

}  // namespace rapid

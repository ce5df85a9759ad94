// The frames of -f.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "bindings/command_line/options.h"
#include "include/rapid/run.h"

namespace rapid {

// Without -f: two seconds at 24 frames a second.
constexpr std::int64_t default_frames = 48;

// 1-48, 1-48x2, 12. All frames from the scene's first one are computed; these are written. Error: the text is not of
// this form.
RunFrames read_frames(const std::string& text);

// One frame, for another option. Error: the text is not a whole number of 32 bits.
std::int64_t read_frame(const std::string& option, const std::string& text);

// Declares -f. doc: which frames they are, and how many are taken without it.
void declare_frames(Options& options, std::optional<RunFrames>& frames, const std::string& doc);

}  // namespace rapid

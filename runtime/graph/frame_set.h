// Frames by number: {12, 48}.
#pragma once

#include <cstdint>
#include <set>
#include <string_view>

#include "runtime/graph/param.h"

namespace rapid {

struct FrameSet {
    static constexpr std::string_view param_type = "list of frames";
    std::set<std::int64_t> frames;
};

// Throws Error if a frame is not an integer.
void read_value(const Param& param, const Value& value, FrameSet& field);

}  // namespace rapid

// The time of each pass of a frame.
#pragma once

#include <string>

#include "runtime/graph/evaluate.h"

namespace rapid {

const char* name_of(NodeWork::Stage stage);  // "graph", "script", "solve"

// A list in one line: a member for each pass, in order.
std::string profile_json(const FrameResult& result);

}  // namespace rapid

// The table of native functions that lua/host.lua is given.
#pragma once

#include <string>

namespace rapid {

class State;

// Pushes it. chunk_header: the text of lua/chunk.h.
void push_natives(State& state, const std::string& chunk_header);

}  // namespace rapid

// The table of native functions passed to lua/host.lua.
#pragma once

#include <string>

namespace rapid {

class State;

// Pushes the table. chunk_header: the text of lua/chunk.h.
void push_natives(State& state, const std::string& chunk_header);

}  // namespace rapid

// The table of native functions that lua/host.lua is given.
#pragma once

#include <cstddef>
#include <string>

namespace rapid {

class State;

// Pushes it. chunk_header: the text of lua/chunk.h.
void push_natives(State& state, const std::string& chunk_header);

// What a state is told that needs more than so many bytes.
std::string memory_limit_text(std::size_t bytes);

}  // namespace rapid

// A Lua function of the frame: a parameter's value that is evaluated at each frame.
#pragma once

#include <memory>

#include "runtime/graph/value.h"

namespace rapid {

class State;

// Returns the function at `index` of the main state's stack. The registry holds it as long as any node does.
std::shared_ptr<const FrameFunction> script_function(State& state, int index);

// Reads the function's bytecode. Throws Error if it stores something for its next call, which no snapshot can
// hold.
void refuse_memory(const FrameFunction& function);

}  // namespace rapid

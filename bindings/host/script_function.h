// A function of the frame, written in Lua: a parameter's value that is asked for at each frame.
#pragma once

#include <memory>

#include "runtime/graph/value.h"

namespace rapid {

class State;

// The function at `index` of the main state's stack; kept in its registry while any node holds it.
std::shared_ptr<const FrameFunction> script_function(State& state, int index);

// Reads the bytecode of such a function. Error: it keeps something for its next call, which no snapshot can hold.
void refuse_memory(const FrameFunction& function);

}  // namespace rapid

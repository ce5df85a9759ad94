// Functions over a whole set of points, written in Lua: what :detail runs.
#pragma once

#include "runtime/graph/node.h"

struct lua_State;

namespace rapid {

class Kernel;
class State;
struct KernelArguments;

// Runs the function once, in the main state: function(points, frame, params). Points that it added are appended, with
// ids of their own, and those that it killed removed, when it ends. Error: what it raised, with the frame.
void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments);

// As scripts see it.
Value value_of(const DetailValue& detail);

// Pushes the table of native functions that lua/detail.lua is given.
void push_detail_natives(State& state);

}  // namespace rapid

// Distinguishes memory requests of code that LuaJIT compiled from those of its interpreter.
//
// If a request fails, LuaJIT looks for the running function to put its error on that function's stack. While compiled
// code runs, the interpreter's position is out of date: LuaJIT may find something there that is not a function, and
// crash.
#pragma once

namespace rapid {

// Returns true if compiled code made the current request. Call it below LuaJIT's allocator. It allocates nothing.
bool is_called_by_compiled_code();

}  // namespace rapid

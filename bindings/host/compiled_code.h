// Whether LuaJIT asks for memory from code that it compiled, or from its interpreter.
//
// Where a request fails LuaJIT looks for the function that runs, to put its error on that one's stack. While compiled
// code runs the interpreter's place is out of date: what LuaJIT finds there may be no function, and it ends by a
// signal.
#pragma once

namespace rapid {

// Of the request that is being answered: to be called below LuaJIT's allocator. Takes no memory.
bool is_asked_by_compiled_code();

}  // namespace rapid

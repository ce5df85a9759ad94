// Functions that compiled kernels call directly by address (lua/chunk.h has their types).
#pragma once

struct lua_State;

namespace rapid {

// Sets the addresses in the table at the top of the stack.
void set_kernel_functions(lua_State* L);

}  // namespace rapid

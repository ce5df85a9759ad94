// Guarded memory: each block ends at an inaccessible page, and becomes inaccessible itself when it is freed. An access
// past its end or after its release therefore ends the process at once. Works for any code in the process, including
// Lua and other libraries, without recompilation.
#pragma once

#include <cstddef>

namespace guard {

// Returns null if blocks are not guarded, or if the number of blocks or the address space is exhausted.
void* take(std::size_t alignment, std::size_t bytes);
// Returns true if the block is guarded. size_of() returns the requested size of a guarded block.
bool is_guarded(const void* block);
std::size_t size_of(const void* block);
// Frees a guarded block. Ends the process if the bytes between its end and the guard page were written to.
void give_back(void* block);

}  // namespace guard

// Memory with a wall behind it: each block ends at a page that can't be touched, and can't be touched itself when it
// was freed, so that what reads or writes beyond it ends the process at once. For whatever the process runs, Lua and
// other libraries too, none of it built for that.
#pragma once

#include <cstddef>

namespace guard {

// Null where blocks are not guarded, there are too many, or there is no room.
void* take(std::size_t alignment, std::size_t bytes);
// Whether the block is a guarded one; then its size, as it was asked for.
bool is_guarded(const void* block);
std::size_t size_of(const void* block);
// A guarded block. Ends the process if what is between its end and the wall was written to.
void give_back(void* block);

}  // namespace guard

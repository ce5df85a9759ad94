// Fills uninitialised memory. A program that reads from it behaves differently when it runs again with another byte.
#pragma once

namespace rapid::test {

// Fills new memory of this process and of its copies with the byte from here on.
void fill_new_memory(unsigned char byte);

// Fills the stack below the caller's frame.
void fill_stack(unsigned char byte);

}  // namespace rapid::test

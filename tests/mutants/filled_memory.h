// Memory that nobody has written yet, with a pattern in it: what a program reads from there shows when it runs again
// with another pattern.
#pragma once

namespace rapid::test {

// From here on new memory of this process and of its copies is filled with the byte.
void fill_new_memory(unsigned char byte);

// Fills the stack below the caller's frame.
void fill_stack(unsigned char byte);

}  // namespace rapid::test

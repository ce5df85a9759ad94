// The headers that the loaded library was built with.
#pragma once

namespace rapid {

// RAPID_ABI (abi.h) as the library has it. A program compares it with its own: among the libraries of several processor
// levels the loader may find one of another build.
const char* library_abi();

}  // namespace rapid

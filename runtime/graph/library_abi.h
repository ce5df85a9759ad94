// Identifies the headers that the loaded library was built with.
#pragma once

namespace rapid {

// Returns the library's RAPID_ABI (abi.h). A program compares it with its own: with libraries for several processor
// levels, the loader may find one from another build.
const char* library_abi();

}  // namespace rapid

// The location of the library.
#pragma once

#include <filesystem>

namespace rapid {

// Returns the loaded library file, with symbolic links resolved. Empty if the system does not know it.
std::filesystem::path library_file();

// Returns the folder with the other parts of the library. A library for one processor level is below it, in
// glibc-hwcaps/LEVEL (cmake/RapidLevels.cmake).
std::filesystem::path library_folder();

}  // namespace rapid

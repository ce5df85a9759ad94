// Where the library is.
#pragma once

#include <filesystem>

namespace rapid {

// The file that is loaded, without symbolic links. Empty if the system does not know it.
std::filesystem::path library_file();

// The folder that holds the other parts of the library. A library for one processor level lies below it, in
// glibc-hwcaps/LEVEL (cmake/RapidLevels.cmake).
std::filesystem::path library_folder();

}  // namespace rapid

// Where the library is.
#pragma once

#include <filesystem>

namespace rapid {

// The folder of the library's parts, by the file that is loaded: of a build for a newer processor, which lies below in
// glibc-hwcaps/LEVEL (cmake/RapidLevels.cmake), that of all of them.
std::filesystem::path library_folder();

}  // namespace rapid

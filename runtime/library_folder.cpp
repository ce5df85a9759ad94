#include "runtime/library_folder.h"

#include <dlfcn.h>

namespace rapid {

std::filesystem::path library_folder()
{
    Dl_info here{};
    dladdr(reinterpret_cast<const void*>(&library_folder), &here);
    // The target of a symbolic link: the parts are beside it.
    std::error_code missing;
    const auto file = std::filesystem::canonical(here.dli_fname ? here.dli_fname : "", missing);
    const std::filesystem::path folder = file.parent_path(), above = folder.parent_path();
    return above.filename() == "glibc-hwcaps" ? above.parent_path() : folder;
}

}  // namespace rapid

#include "runtime/base/library_folder.h"

#include <dlfcn.h>

namespace rapid {

std::filesystem::path library_file()
{
    Dl_info here{};
    dladdr(reinterpret_cast<const void*>(&library_file), &here);
    std::error_code missing;
    return std::filesystem::canonical(here.dli_fname ? here.dli_fname : "", missing);
}

std::filesystem::path library_folder()
{
    const std::filesystem::path folder = library_file().parent_path(), above = folder.parent_path();
    return above.filename() == "glibc-hwcaps" ? above.parent_path() : folder;
}

}  // namespace rapid

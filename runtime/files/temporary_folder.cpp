#include "runtime/files/temporary_folder.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>

#include "runtime/files/file_error.h"

namespace rapid {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder(const std::string& purpose)
{
    std::string name = (fs::temp_directory_path() / fmt::format("rapid-{}-XXXXXX", purpose)).string();
    if (!mkdtemp(name.data())) throw file_error(fmt::format("can't make a folder for a {}: {}", purpose, name), errno);
    path_ = name;
}

TemporaryFolder::~TemporaryFolder()
{
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

}  // namespace rapid

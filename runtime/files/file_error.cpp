#include "runtime/files/file_error.h"

#include <fmt/format.h>
#include <unistd.h>

#include <system_error>

namespace rapid {

Error file_error(const std::string& what, int system_error)
{
    return Error(fmt::format("{}: {}", what, std::generic_category().message(system_error)));
}

Descriptor::~Descriptor()
{
    if (number_ >= 0) ::close(number_);
}

}  // namespace rapid

// Checks the name of a .vdb file that a script writes.
#pragma once

#include <fmt/format.h>

#include <string>

#include "runtime/base/error.h"

namespace rapid {

// Throws Error for another extension: a script must not overwrite other files of the user.
inline void require_vdb(const std::string& path)
{
    if (!path.ends_with(".vdb"))
        throw Error(
            fmt::format("path = \"{}\": grids can only be written as .vdb; give a name such as \"surface.vdb\"", path));
}

}  // namespace rapid

// Fogs and vector grids to .vdb files.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "runtime/deferred.h"
#include "runtime/object.h"

namespace rapid {

// Several grids in one file, each under its name. Error: an object that is neither a fog nor a vector grid, or is a
// sequence of them; a full disk.
RAPID_DEFERRED(write_grids, void(const std::filesystem::path& path, const std::map<std::string, ObjectPtr>& grids));

}  // namespace rapid

// Writes fogs and vector grids to .vdb files.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "runtime/base/deferred.h"
#include "runtime/base/object.h"

namespace rapid {

// Writes several grids to one file, each under its name. Throws Error if an object is neither a fog nor a vector grid,
// if it is a sequence of them, or if the disk is full.
RAPID_DEFERRED(write_grids, void(const std::filesystem::path& path, const std::map<std::string, ObjectPtr>& grids));

}  // namespace rapid

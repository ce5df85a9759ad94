// .vdb, as far as it needs no OpenVDB.
#pragma once

#include "runtime/deferred.h"
#include "runtime/io/format.h"

namespace rapid {

RAPID_DEFERRED(vdb_writer, void(const std::filesystem::path& path, const PointSet& points, const FrameInfo& frame));
RAPID_DEFERRED(vdb_reader, PointSet(const std::filesystem::path& path));

}  // namespace rapid

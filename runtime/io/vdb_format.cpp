// Registers .vdb. Its writer and reader (vdb_write.cpp, vdb_read.cpp) are loaded on demand.
#include "runtime/io/vdb.h"

namespace rapid {
namespace {

void write_vdb(OutputFile& file, const PointSet& points, const FrameInfo& frame) { vdb_writer(file, points, frame); }

PointSet read_vdb(const std::filesystem::path& path) { return vdb_reader(path); }

RAPID_FORMAT(Format{".vdb", "OpenVDB points, read by Houdini; keeps every bit", write_vdb, read_vdb});

}  // namespace
}  // namespace rapid

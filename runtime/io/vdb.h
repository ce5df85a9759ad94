// .vdb: OpenVDB points, one PointDataGrid "points", readable by Houdini and all OpenVDB software.
//
// Attributes keep their names and become OpenVDB's float, vec3s, int32, int64, quats and str, uncompressed in memory
// and packed with Blosc in the file. A value that all points share is a uniform array in every leaf. Groups are OpenVDB
// point groups. A set without points is one empty leaf, which defines the attributes and groups.
//
// Positions are exact. OpenVDB stores a position as an offset from the centre of its voxel. With a voxel size that is a
// power of two and no translation, both the division and the offset are exact in float (the offset has no more bits
// than the position). Reading therefore returns bit-identical positions for every |P| from voxel 2^-126 to voxel 2^30.
//
// Reading merges the points of all PointDataGrids of a file, with any codecs, in order of id.
//
// Both functions are loaded with OpenVDB on first use.
#pragma once

#include "runtime/base/deferred.h"
#include "runtime/io/format.h"
#include "runtime/points/point_set.h"

namespace rapid {

RAPID_DEFERRED(vdb_writer, void(OutputFile& file, const PointSet& points, const FrameInfo& frame));
RAPID_DEFERRED(vdb_reader, PointSet(const std::filesystem::path& path));

// Returns the exponent e of a voxel size 2^e m at which an occupied leaf has about 2,000 points. Throws Error if a
// position is not finite.
int voxel_exponent(const PointSet& points);

}  // namespace rapid

// .vdb: OpenVDB points, one PointDataGrid "points", as Houdini and everything else with OpenVDB reads it.
//
// Attributes keep their names and become OpenVDB's float, vec3s, int32, int64, quats and str, uncompressed in memory
// and packed with Blosc in the file. A value that all points share is a uniform array in every leaf; groups are OpenVDB
// point groups. A set without points is one empty leaf, which defines the attributes and groups.
//
// Positions are exact. OpenVDB stores a position as an offset from the centre of its voxel. With a voxel size that is a
// power of two and no translation, both the division and the offset are exact in float (the offset has no more bits
// than the position), so that reading returns the same bits, for every |P| from voxel 2^-126 to voxel 2^30.
//
// Reading takes the points of all PointDataGrids of a file, with any codecs, in order of id.
//
// Both functions are loaded with OpenVDB when they are first called.
#pragma once

#include "runtime/deferred.h"
#include "runtime/io/format.h"

namespace rapid {

RAPID_DEFERRED(vdb_writer, void(OutputFile& file, const PointSet& points, const FrameInfo& frame));
RAPID_DEFERRED(vdb_reader, PointSet(const std::filesystem::path& path));

}  // namespace rapid

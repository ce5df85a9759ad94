// Points in the order of OpenVDB's tree: leaf by leaf (8³ voxels), then by voxel, then by index in the set. This is the
// order of openvdb::tools::PointIndexGrid, in a quarter of its memory. Columns in files (column_files.h) are sorted
// there, a few leaves at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/base/openvdb_grids.h"
#include "runtime/points/point_set.h"

namespace rapid {

struct VdbLeaf {
    openvdb::Coord origin;                   // in voxels
    std::size_t first = 0;                   // of its first point in the order
    std::uint32_t size = 0;                  // number of points
    openvdb::util::NodeMask<3> voxels = {};  // voxels with points
    std::vector<std::uint32_t> counts = {};  // points per voxel of `voxels`, in order
};

class VdbOrder {
public:
    // voxel: edge length, m, a power of two. P must be finite and within 2^30 voxels.
    VdbOrder(const PointSet& points, double voxel);

    // Returns the leaves that have points, in tree order.
    const std::vector<VdbLeaf>& leaves() const { return leaves_; }
    // Returns the points. The k-th one in order is at place(k).
    const PointSet& points() const { return points_; }
    std::size_t index(std::size_t k) const { return is_sorted_ ? k : static_cast<std::uint32_t>(entries_[k]); }

private:
    PointSet points_;
    bool is_sorted_;  // points_ itself is in order
    Column<std::int64_t> entries_;
    std::vector<VdbLeaf> leaves_;
};

}  // namespace rapid

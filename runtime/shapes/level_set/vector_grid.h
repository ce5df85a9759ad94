// A vector field: an OpenVDB grid, read from a file or built from values at the nodes of a lattice.
//
// Trilinear between voxels, with second-order accuracy. Where the grid has no values it is its background, {0, 0, 0}
// unless the file says otherwise. Values are in world axes: a rotation in the grid's map moves the voxels but not the
// values. A staggered grid (from a fluid solver, with each component on its own faces of the voxel) is sampled as
// staggered.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "runtime/base/deferred.h"
#include "runtime/base/object.h"
#include "runtime/math/vec.h"

namespace rapid {

class VectorGrid : public Object {
public:
    using Value = Vec3d;
    static constexpr std::string_view param_type = "vector grid";
    std::string_view kind() const override { return "vector grid"; }

    // Samples the field. P, values: shape [n], m and the grid's own unit. Thread-safe. A time-dependent grid is sampled
    // at the end of the step being computed.
    virtual void sample(std::span<const Vec3d> P, std::span<Vec3d> values) const = 0;
    // Samples each position at its own time, s since the start of the simulation.
    virtual void sample_at(std::span<const Vec3d> P, std::span<const double> time, std::span<Vec3d> values) const
    {
        static_cast<void>(time);
        sample(P, values);
    }
};

using VectorGridPtr = std::shared_ptr<const VectorGrid>;

// Reads the grid of that name from a .vdb file; an empty name selects the only grid of three floats. Throws Error if
// the file is damaged or has no such grid (the message lists those it has).
RAPID_DEFERRED(read_vector_grid, VectorGridPtr(const std::filesystem::path& path, const std::string& name));

// Creates a lattice with nodes `voxel` metres apart, starting at `origin`. values: shape [nodes x, y, z], z fastest.
RAPID_DEFERRED(make_vector_grid, VectorGridPtr(const Vec3d& origin, double voxel, const Eigen::Vector3i& nodes,
                                               std::span<const Vec3f> values));

}  // namespace rapid

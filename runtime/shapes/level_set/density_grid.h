// A fog volume: an OpenVDB float grid, read from a file or made from points. Points are born in it in proportion to its
// density.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/base/deferred.h"
#include "runtime/base/object.h"
#include "runtime/math/vec.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

class DensityGrid : public Object {
public:
    using Value = double;
    static constexpr std::string_view param_type = "fog";
    std::string_view kind() const override { return "fog"; }

    // Samples the density, trilinear between voxel centres. The arguments are those of VectorGrid (vector_grid.h).
    virtual void sample(std::span<const Vec3d> P, std::span<double> values) const = 0;
    virtual void sample_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> values) const
    {
        static_cast<void>(time);
        sample(P, values);
    }

    // Returns births in proportion to the density. For a time-dependent fog: the density at the end of the step being
    // computed.
    virtual const ScatterPtr& scatter() const = 0;
    // Returns the integral of the density over all space, m³.
    virtual double total() const = 0;
};

using DensityGridPtr = std::shared_ptr<const DensityGrid>;

// Reads the grid of that name from a .vdb file; an empty name selects the only float fog. Throws Error if the file is
// damaged, if it has no such grid (the message lists those it has), or if the grid is a level set, has negative
// densities, or is 0 everywhere.
RAPID_DEFERRED(read_density_grid, DensityGridPtr(const std::filesystem::path& path, const std::string& name));

}  // namespace rapid

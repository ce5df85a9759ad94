// A fog volume: an OpenVDB grid of floats, read from a file or made of points, in which points are born by density.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/deferred.h"
#include "runtime/object.h"
#include "runtime/shapes/scatter/scatter.h"
#include "runtime/vec.h"

namespace rapid {

class DensityGrid : public Object {
public:
    using Value = double;
    static constexpr std::string_view param_type = "fog";
    std::string_view kind() const override { return "fog"; }

    // The density, trilinear between the centres of voxels; as of a vector grid (vector_grid.h).
    virtual void sample(std::span<const Vec3d> P, std::span<double> values) const = 0;
    virtual void sample_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> values) const
    {
        static_cast<void>(time);
        sample(P, values);
    }

    // Births in proportion to the density. Of a fog that changes with time, at the end of the step that it is for.
    virtual const ScatterPtr& scatter() const = 0;
    // The integral of the density over all space, m³.
    virtual double total() const = 0;
};

using DensityGridPtr = std::shared_ptr<const DensityGrid>;

// The grid of that name in a .vdb file; an empty name is the only fog of floats. Error: what is wrong with the file,
// and which grids it has; a level set; a density below 0, or of 0 everywhere.
RAPID_DEFERRED(read_density_grid, DensityGridPtr(const std::filesystem::path& path, const std::string& name));

}  // namespace rapid

// A fog volume: an OpenVDB grid of floats, read from a file, in which points are born by density.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/deferred.h"
#include "runtime/object.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

class DensityGrid : public Object {
public:
    static constexpr std::string_view param_type = "fog";
    std::string_view kind() const override { return "fog"; }

    // Births in proportion to the density, trilinear between the centres of voxels.
    virtual const ScatterPtr& scatter() const = 0;
};

using DensityGridPtr = std::shared_ptr<const DensityGrid>;

// The grid of that name in a .vdb file; an empty name is the only fog of floats. Error: what is wrong with the file,
// and which grids it has; a level set; a density below 0, or of 0 everywhere.
RAPID_DEFERRED(read_density_grid, DensityGridPtr(const std::filesystem::path& path, const std::string& name));

}  // namespace rapid

// What `:rasterize` writes: the density of points, and means of their vectors, as volumes. The command that writes
// files reads it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/node.h"

namespace rapid {

class Plan;
struct PlannedNode;

struct Rasterize {
    std::string file, group;
    double voxel;  // m
    std::optional<PerPoint<float>> radius;
    PerPoint<float> weight;
    std::vector<std::string> attributes;

    static NodeType declare();
    void uses(Uses& uses) const;
    void check() const;
    std::string couples(const Plan& plan, const PlannedNode& node) const;

    // The points stay as they are.
    void edit(PointSet& points, const Evaluation& now) const;
    Flow start(std::span<Flow> inputs, const Evaluation& now) const;

    // The file of points that edit() has given to Evaluation::write: the grid density, and one for each attribute.
    // Error: as density_of_points (grid_of_points.h); a full disk.
    void write_volumes(const std::filesystem::path& path, const PointSet& points) const;
};

}  // namespace rapid

// The settings of `:rasterize`, which writes the density of points, and means of their vectors, as volumes. The
// command that writes files reads them.
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

    // Leaves the points unchanged.
    void edit(PointSet& points, const Evaluation& now) const;
    Flow start(std::span<Flow> inputs, const Evaluation& now) const;

    // Writes the volumes of the points that edit() passed to Evaluation::write: the grid density, and one per
    // attribute. Throws Error as density_of_points does (grid_of_points.h), or if the disk is full.
    void write_volumes(const std::filesystem::path& path, const PointSet& points) const;
};

}  // namespace rapid

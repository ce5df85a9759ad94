// Assigns points to grids of cells by their radii (paper §5.2, Algorithm 1). Cells as wide as the largest sphere in
// them hold too many of the smallest, so several sizes use several grids.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/points/column.h"

namespace rapid {

class RadiusGrids {
public:
    // max_difference: m, between the radii in a grid; default: half of its largest radius. Points of radius 0 touch
    // nothing and are in no grid.
    RadiusGrids(Strided<float> radius, std::size_t size, std::optional<double> max_difference, int max_grids);

    struct Grid {
        double radius;  // m, the largest in it
        std::size_t points;
    };
    std::vector<Grid> grids;       // from coarse to fine
    std::vector<std::uint8_t> of;  // grid of each point; empty if there is at most one grid, with all points
    static constexpr std::uint8_t none = 255;

    // Excess volume of the cells over their spheres, m³ (paper, eq. 5): Σ s³ - 4/3 π r³, with s = 2 R; and relative to
    // cells of the exact size: Σ (s³ - (2r)³) / Σ (2r)³, which is 0 if all radii in each grid are equal.
    double error = 0, excess = 0;

private:
    void cluster(std::span<const float> descending, std::optional<double> max_difference, int max_grids,
                 std::vector<float>& least);
    void assign(Strided<float> radius, std::size_t size, std::span<const float> least);
    void measure(Strided<float> radius, std::size_t size);
};

}  // namespace rapid

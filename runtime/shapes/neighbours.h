// The points within a radius of a place, by an OpenVDB point index grid.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/vec.h"

namespace rapid {

class Neighbours {
public:
    // P: shape [n], m, kept as they are now. radius: of the queries, > 0, m. Error: so small that the grid would need
    // more than 2^31 voxels along an axis.
    Neighbours(std::span<const Vec3f> P, double radius);
    ~Neighbours();
    Neighbours(const Neighbours&) = delete;
    Neighbours& operator=(const Neighbours&) = delete;

    // The places in P of the points that are at most the radius from X, in order. From any number of threads.
    void find(const Vec3d& X, std::vector<std::uint32_t>& places) const;

private:
    struct Grid;
    std::unique_ptr<const Grid> grid_;
};

}  // namespace rapid

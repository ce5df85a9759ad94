// The points within a radius of a position, by an OpenVDB point index grid.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/deferred.h"
#include "runtime/vec.h"

namespace rapid {

class Neighbours {
public:
    virtual ~Neighbours() = default;

    // The indices of the points at most the radius from X, ascending. From any number of threads.
    virtual void find(const Vec3d& X, std::vector<std::uint32_t>& indices) const = 0;
};

// P: shape [n], m, copied. radius: of the queries, > 0, m. Error: so small that the grid would need more than 2^31
// voxels along an axis.
RAPID_DEFERRED(index_neighbours, std::unique_ptr<const Neighbours>(std::span<const Vec3f> P, double radius));

}  // namespace rapid

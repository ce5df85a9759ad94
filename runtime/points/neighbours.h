// The points within a radius of a position or of each other, found with cells as wide as the radius (cell_grid.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/math/vec.h"
#include "runtime/points/cell_grid.h"
#include "runtime/points/near_spheres.h"
#include "runtime/points/sort_few.h"

namespace rapid {

class Neighbours {
public:
    // P: shape [n], m, copied. radius: query radius, > 0, m. Throws Error if the radius is below 2^-30 of the largest
    // coordinate.
    Neighbours(std::span<const Vec3f> P, double radius);
    Neighbours(const Neighbours&) = delete;
    Neighbours& operator=(const Neighbours&) = delete;

    // Sets `indices` to the points at most the radius from X, ascending. Thread-safe.
    void find(const Vec3d& X, std::vector<std::uint32_t>& indices) const;

    // Calls f(i, others) for each point, on all threads. `others` are the ascending indices of the points within the
    // radius of it, including itself, in a vector that f may modify. Points are visited in cell order, so that
    // neighbourhoods stay in the caches.
    template <class F>
    void for_each(const F& f) const
    {
        for_each_chunk(grid_.size(), [&](std::size_t begin, std::size_t end) {
            NearSpheres spheres;
            std::vector<std::uint32_t> found, near;
            grid_.for_each_stretch(begin, end, [&](std::size_t m, std::size_t last, std::size_t from, std::size_t to) {
                spheres.gather(grid_, grid_.around(grid_.key(from), grid_.key(to)));
                found.resize(std::max<std::size_t>(found.size(), spheres.size() + max_sorted_by_rank));
                for (; m < last; ++m) {
                    list(m, spheres, found, near);
                    f(grid_.index[m], near);
                }
            });
        });
    }

private:
    // found: scratch memory with room for all of the spheres and for sorting.
    void list(std::size_t sphere, const NearSpheres& spheres, std::span<std::uint32_t> found,
              std::vector<std::uint32_t>& near) const;
    bool is_near(std::uint32_t point, const Vec3d& X) const
    {
        return (P_[point] - X).squaredNorm() <= radius_ * radius_;
    }

    PageArray<Vec3d> P_;
    double radius_;
    SpheresView spheres_;  // in units of the radius, so that no radius is too small for single precision
    float blur_ = 0;
    CellGrid grid_;
};

}  // namespace rapid

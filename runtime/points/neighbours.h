// The points within a radius of a position, or of each other, by cells as wide as the radius (cell_grid.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/parallel.h"
#include "runtime/points/cell_grid.h"
#include "runtime/points/near_spheres.h"
#include "runtime/vec.h"

namespace rapid {

class Neighbours {
public:
    // P: shape [n], m, copied. radius: of the queries, > 0, m. Error: below 2^-30 of the largest coordinate.
    Neighbours(std::span<const Vec3f> P, double radius);

    // The indices of the points at most the radius from X, ascending. From any number of threads.
    void find(const Vec3d& X, std::vector<std::uint32_t>& indices) const;

    // Calls f(i, others) for each of the points, on all threads, with the indices of those at most the radius from it,
    // itself among them: ascending, in a vector that f may change. In the order of the cells: neighbours of neighbours
    // are in the caches.
    template <class F>
    void for_each(const F& f) const
    {
        for_each_chunk(grid_.size(), [&](std::size_t begin, std::size_t end) {
            std::vector<std::uint32_t> near;
            std::size_t cell = grid_.cell_of_sphere(begin);
            for (std::size_t m = begin; m < end; ++cell) {
                const std::size_t last = std::min<std::size_t>(end, grid_.end(cell));
                if (m == last) continue;
                const CellGrid::Runs runs = around(grid_.key(cell));
                for (; m < last; ++m) {
                    list(m, runs, near);
                    f(grid_.place[m], near);
                }
            }
        });
    }

private:
    CellGrid::Runs around(std::uint64_t key) const;
    void list(std::size_t sphere, const CellGrid::Runs& runs, std::vector<std::uint32_t>& near) const;
    bool is_near(std::uint32_t point, const Vec3d& X) const
    {
        return (P_[point] - X).squaredNorm() <= radius_ * radius_;
    }

    std::vector<Vec3d> P_;
    double radius_;
    Vec3d middle_ = Vec3d::Zero();  // in radii, as all of the grid
    float blur_ = 0;
    CellGrid grid_;
};

}  // namespace rapid

// Spheres sorted into the cells of a sparse uniform grid: along x, then y, then z, with the spheres copied in that
// order. OpenVDB's point index grid answers the same questions 2 to 8 times slower. Empty space costs nothing in
// either.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/points/page_array.h"
#include "runtime/simd.h"
#include "runtime/vec.h"

namespace rapid {

// The spheres of a search, of which a grid takes those that it is told.
struct SpheresView {
    std::span<const Vec3d> P;  // m
    Strided<float> reach;      // in units of the grid
    Vec3d middle;              // m, of all of them: what cells count from
    double scale = 1;          // units of the grid in a metre

    Vec3d in_grid(const Vec3d& X) const { return scale * (X - middle); }
};

// Sorts by buckets that fit a cache first; kept between grids for its memory.
class CellSorter;

// The cells of one grid, with a border of empty ones.
class CellGrid {
public:
    double width = 0;                // of a cell, in units of the grid, as all that follows
    PageArray<std::uint32_t> place;  // of each sphere, its index in the set
    PageArray<float> x, y, z, r;     // from the middle of the scene; padded for whole simd packs by any numbers

    std::size_t size() const { return place.size(); }

    // A run of spheres.
    struct Run {
        std::uint32_t begin, end;
    };
    // The spheres in the cells of these keys, the last one included: part of a row along x.
    Run run(std::uint64_t first, std::uint64_t last) const
    {
        return dense_ ? Run{begin_[first], begin_[last + 1]} : find_run(first, last);
    }

    // Of several rows, those that are not empty.
    class Runs {
    public:
        void add(const Run& run)
        {
            if (run.begin < run.end) all_[size_++] = run;
        }
        const Run* begin() const { return all_; }
        const Run* end() const { return all_ + size_; }

    private:
        Run all_[9];
        int size_ = 0;
    };
    using Cell = std::array<std::int64_t, 3>;  // its coordinates
    Cell cell_at(const Vec3d& X) const;
    // In any cell and its neighbours.
    Runs around(const Cell& cell) const;
    // In the cells of a row from key `first` to `last`, which hold spheres, and their neighbours.
    Runs around(std::uint64_t first, std::uint64_t last) const
    {
        Runs runs;
        add_rows(runs, first - layer_step() - row_step() - 1, {last - first + 3, 3, 3});
        return runs;
    }
    // Half of these: in the cells themselves, which are first, and in those behind them.
    Runs behind(std::uint64_t first, std::uint64_t last) const
    {
        Runs runs;
        add_rows(runs, first, {last - first + 2, 1, 1});
        add_rows(runs, first + row_step() - 1, {last - first + 3, 1, 1});
        add_rows(runs, first + layer_step() - row_step() - 1, {last - first + 3, 3, 1});
        return runs;
    }

    // Calls f(begin, end, first, last) for the spheres from `begin` to `end`, by cells that follow each other in a row
    // and hold some: by as many as have a few spheres together, whose neighbours are then looked up once.
    template <class F>
    void for_each_stretch(std::size_t begin, std::size_t end, const F& f) const
    {
        constexpr std::size_t few = 4;
        std::size_t cell = cell_of_sphere(begin);
        for (std::size_t m = begin; m < end; ++cell) {
            if (m == begin_[cell + 1]) continue;
            const std::size_t first = cell;
            while (begin_[cell + 1] < std::min(m + few, end) && key(cell + 1) == key(cell) + 1 &&
                   begin_[cell + 1] < begin_[cell + 2])
                ++cell;
            const std::size_t last = std::min<std::size_t>(end, begin_[cell + 1]);
            f(m, last, first, cell);
            m = last;
        }
    }

    // Cells in memory, the empty ones left out where the grid is sparse: the key of each, and its spheres.
    std::size_t cells() const { return begin_.empty() ? 0 : begin_.size() - 1; }
    std::size_t cell_of_sphere(std::size_t sphere) const;
    std::uint64_t key(std::size_t cell) const { return dense_ ? cell : key_[cell]; }
    std::uint32_t begin(std::size_t cell) const { return begin_[cell]; }
    std::uint32_t end(std::size_t cell) const { return begin_[cell + 1]; }
    // Keys from one row to the next, and from one layer to the next.
    std::uint64_t row_step() const { return static_cast<std::uint64_t>(count_[0]); }
    std::uint64_t layer_step() const { return row_step() * static_cast<std::uint64_t>(count_[1]); }

private:
    friend class CellSorter;

    Run find_run(std::uint64_t first, std::uint64_t last) const;
    // Those of a box of so many cells along each axis, of which this is the first.
    void add_rows(Runs& runs, std::uint64_t first, const std::array<std::uint64_t, 3>& cells) const
    {
        for (std::uint64_t k = 0; k < cells[2]; ++k)
            for (std::uint64_t j = 0; j < cells[1]; ++j) {
                const std::uint64_t row = first + k * layer_step() + j * row_step();
                runs.add(run(row, row + cells[0] - 1));
            }
    }

    std::uint64_t key_of(std::int64_t i, std::int64_t j, std::int64_t k) const
    {
        const auto at = [&](std::int64_t c, int axis) { return static_cast<std::uint64_t>(c - least_[axis]); };
        return (at(k, 2) * static_cast<std::uint64_t>(count_[1]) + at(j, 1)) * static_cast<std::uint64_t>(count_[0]) +
               at(i, 0);
    }

    std::int64_t least_[3], count_[3];  // cell coordinates
    std::vector<std::uint64_t> key_;    // of the cells that are not empty; not used where dense
    PageArray<std::uint32_t> begin_;    // of these cells' spheres; of all cells where dense
    bool dense_ = false;
};

class CellSorter {
public:
    // Fills the grid, of a given width, with these spheres of the set.
    void fill(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);

private:
    struct Sphere {
        float x, y, z, r;
        std::uint32_t place, cell;
    };
    static Sphere sphere(const SpheresView& spheres, std::uint32_t place, std::uint64_t cell);
    static void put(CellGrid& grid, std::size_t m, const Sphere& sphere);

    std::size_t bound(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members) const;
    void find_keys(const CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);
    void sort_dense(CellGrid& grid, std::size_t cells, const SpheresView& spheres,
                    std::span<const std::uint32_t> members);
    void sort_sparse(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);

    PageArray<std::uint64_t> keys_;             // of the cell of each sphere
    PageArray<Sphere> spheres_;                 // by buckets
    std::vector<std::uint32_t> starts_, ends_;  // by bucket and source
    PageArray<std::uint32_t> order_;
};

// How many items are sorted together: in the second-level cache, and on all threads.
std::size_t bucket_size(std::size_t n);

}  // namespace rapid

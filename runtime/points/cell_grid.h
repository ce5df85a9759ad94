// Spheres sorted into the cells of a uniform grid: by z, then y, then x. The grid stores copies of the spheres in that
// order. Empty space costs nothing. OpenVDB's point index grid answers the same queries 2 to 8 times slower.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "runtime/math/simd.h"
#include "runtime/math/vec.h"
#include "runtime/points/buffer.h"
#include "runtime/points/column.h"

namespace rapid {

// An array in a block of pages (buffer.h) whose values are not initialised. For large, short-lived arrays that are
// written before they are read.

template <class T>
class PageArray {
public:
    static_assert(std::is_trivially_destructible_v<T>, "values are moved as bytes");

    PageArray() = default;
    explicit PageArray(std::size_t size) { resize(size); }
    PageArray(const PageArray& other) : PageArray(other.size_) { std::copy(other.begin(), other.end(), begin()); }
    PageArray(PageArray&& other) noexcept : buffer_(std::move(other.buffer_)), size_(std::exchange(other.size_, 0)) {}
    PageArray& operator=(PageArray other) noexcept
    {
        buffer_ = std::move(other.buffer_);
        size_ = other.size_;
        return *this;
    }

    // Resizes the array. New values are indeterminate. Throws std::bad_alloc.
    void resize(std::size_t size)
    {
        if (size > Buffer::max_bytes / sizeof(T)) throw std::bad_alloc();
        buffer_.reserve(size * sizeof(T));
        size_ = size;
    }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T* data() { return static_cast<T*>(buffer_.data()); }
    const T* data() const { return static_cast<const T*>(buffer_.data()); }
    T& operator[](std::size_t i) { return data()[i]; }
    const T& operator[](std::size_t i) const { return data()[i]; }
    T* begin() { return data(); }
    T* end() { return data() + size_; }
    const T* begin() const { return data(); }
    const T* end() const { return data() + size_; }

private:
    Buffer buffer_;
    std::size_t size_ = 0;
};

// The spheres of a search. Each grid contains the members of it that are passed to CellSorter::fill().
struct SpheresView {
    std::span<const Vec3d> P;  // m
    Strided<float> reach;      // in grid units
    Vec3d middle;              // m, origin of the cell coordinates, shared by all grids
    double scale = 1;          // grid units per metre

    Vec3d in_grid(const Vec3d& X) const { return scale * (X - middle); }
};

// Fills grids. Sorts into buckets that fit a cache first. Reuse it between grids to reuse its memory.
class CellSorter;

// The cells of one grid, with a border of empty cells.
class CellGrid {
public:
    double width = 0;                // cell width; like all lengths below in grid units
    PageArray<std::uint32_t> index;  // index of each sphere in the set
    PageArray<float> x, y, z, r;     // relative to `middle`; padded to whole SIMD packs with arbitrary numbers

    std::size_t size() const { return index.size(); }

    // A range of consecutive spheres.
    struct Run {
        std::uint32_t begin, end;
    };
    // Returns the spheres in the cells of keys `first` to `last`, inclusive: part of a row along x.
    Run run(std::uint64_t first, std::uint64_t last) const
    {
        return dense_ ? Run{begin_[first], begin_[last + 1]} : find_run(first, last);
    }

    // The non-empty runs of up to nine rows of cells.
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
    using Cell = std::array<std::int64_t, 3>;  // cell coordinates
    Cell cell_at(const Vec3d& X) const;
    // Returns the spheres in a cell and its neighbours. The cell may be empty.
    Runs around(const Cell& cell) const;
    // Returns the spheres in the occupied cells of keys `first` to `last`, part of a row, and in their neighbours.
    Runs around(std::uint64_t first, std::uint64_t last) const
    {
        Runs runs;
        add_rows(runs, first - layer_step() - row_step() - 1, {last - first + 3, 3, 3});
        return runs;
    }
    // Returns the half of around() with higher keys: first the spheres in the cells themselves, then those in the
    // neighbours after them.
    Runs after(std::uint64_t first, std::uint64_t last) const
    {
        Runs runs;
        add_rows(runs, first, {last - first + 2, 1, 1});
        add_rows(runs, first + row_step() - 1, {last - first + 3, 1, 1});
        add_rows(runs, first + layer_step() - row_step() - 1, {last - first + 3, 3, 1});
        return runs;
    }

    // Calls f(begin, end, first, last) for stretches of the spheres `begin` to `end`. A stretch is a run of occupied
    // cells of a row, `first` to `last`, that ends once it has a few spheres. Their neighbours can be looked up
    // together.
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

    // Access the stored cells (the occupied ones if the grid is sparse), with the key and the spheres of each.
    std::size_t cells() const { return begin_.empty() ? 0 : begin_.size() - 1; }
    std::size_t cell_of_sphere(std::size_t sphere) const;
    std::uint64_t key(std::size_t cell) const { return dense_ ? cell : key_[cell]; }
    std::uint32_t begin(std::size_t cell) const { return begin_[cell]; }
    std::uint32_t end(std::size_t cell) const { return begin_[cell + 1]; }
    // Return the key differences between consecutive rows and between consecutive layers.
    std::uint64_t row_step() const { return static_cast<std::uint64_t>(count_[0]); }
    std::uint64_t layer_step() const { return row_step() * static_cast<std::uint64_t>(count_[1]); }

private:
    friend class CellSorter;

    Run find_run(std::uint64_t first, std::uint64_t last) const;
    // Adds the runs of a box of cells. `first` is its lowest cell and `cells` its size along each axis.
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
    std::vector<std::uint64_t> key_;    // keys of the occupied cells; unused if dense
    PageArray<std::uint32_t> begin_;    // first sphere of each stored cell
    bool dense_ = false;
};

class CellSorter {
public:
    // Fills the grid, whose width is set, with the given members of the set.
    void fill(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);

private:
    struct Sphere {
        float x, y, z, r;
        std::uint32_t index, cell;
    };
    static Sphere sphere(const SpheresView& spheres, std::uint32_t index, std::uint64_t cell);
    static void put(CellGrid& grid, std::size_t m, const Sphere& sphere);

    std::size_t bound(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members) const;
    void find_keys(const CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);
    void sort_dense(CellGrid& grid, std::size_t cells, const SpheresView& spheres,
                    std::span<const std::uint32_t> members);
    void sort_sparse(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members);

    PageArray<std::uint64_t> keys_;             // cell of each sphere
    PageArray<Sphere> spheres_;                 // sorted by bucket
    std::vector<std::uint32_t> starts_, ends_;  // per bucket and source chunk
    PageArray<std::uint32_t> order_;
};

// Returns the number of items per sorting bucket. A bucket fits the second-level cache, and there are enough for all
// threads.
std::size_t bucket_size(std::size_t n);

}  // namespace rapid

#include "runtime/io/vdb_order.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <variant>

#include "runtime/points/column_files.h"

namespace rapid {
namespace {

using openvdb::Coord;

// Per-thread buffers for the time of writing one file. Not thread_local, because in a library that is loaded later
// glibc allocates those on a thread's first use, and terminates the process if that fails.
template <class T>
using PerWorker = tbb::enumerable_thread_specific<T>;

// Points per block; at most 64 blocks, each with its own list of leaves.
constexpr std::size_t min_block = 65536, max_blocks = 64;
// Points of columns in files that are sorted together in memory.
constexpr std::size_t cell_points = 131072;
// Points that are distributed to cells together.
constexpr std::size_t stretch = 131072;

constexpr std::int32_t leaf_edge = 8;

// Maps positions to voxels: the nearest voxel centre, as in OpenVDB.
class Voxels {
public:
    explicit Voxels(double edge) : per_metre_(1 / edge) {}

    Coord of(const Vec3f& P) const { return {along(P.x()), along(P.y()), along(P.z())}; }

private:
    std::int32_t along(float x) const { return static_cast<std::int32_t>(std::floor(x * per_metre_ + 0.5)); }

    double per_metre_;
};

Coord leaf_of(const Coord& voxel) { return voxel & ~(leaf_edge - 1); }

std::uint32_t place_in_leaf(const Coord& voxel)
{
    constexpr std::int32_t mask = leaf_edge - 1;
    return static_cast<std::uint32_t>((voxel.x() & mask) << 6 | (voxel.y() & mask) << 3 | (voxel.z() & mask));
}

// Compares in the order of OpenVDB's tree: root nodes of 4096³ voxels, then nodes of 128³, then leaves.
bool before_in_tree(const Coord& a, const Coord& b)
{
    for (const std::int32_t edge : {4096, 128, leaf_edge}) {
        const Coord of_a = a & ~(edge - 1), of_b = b & ~(edge - 1);
        if (of_a != of_b) return of_a < of_b;
    }
    return false;
}

// Numbers leaves in the order of their first use.
class LeafNumbers {
public:
    LeafNumbers() : slots_(1024) {}

    std::uint32_t add(const Coord& leaf)
    {
        if (2 * leaves_.size() >= slots_.size()) grow();
        Slot& slot = slot_of(leaf);
        if (slot.number == none) {
            slot = {leaf, static_cast<std::uint32_t>(leaves_.size())};
            leaves_.push_back(leaf);
        }
        return slot.number;
    }
    // Returns the number of a leaf that has been added.
    std::uint32_t operator[](const Coord& leaf) const { return const_cast<LeafNumbers*>(this)->slot_of(leaf).number; }
    const std::vector<Coord>& leaves() const { return leaves_; }

private:
    static constexpr std::uint32_t none = UINT32_MAX;
    struct Slot {
        Coord leaf;
        std::uint32_t number = none;
    };

    Slot& slot_of(const Coord& leaf)
    {
        std::uint64_t hash = 0;
        for (const std::int32_t x : {leaf.x(), leaf.y(), leaf.z()})
            hash = (hash ^ static_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15ull, hash ^= hash >> 29;
        for (std::size_t k = hash & (slots_.size() - 1);; k = (k + 1) & (slots_.size() - 1))
            if (slots_[k].number == none || slots_[k].leaf == leaf) return slots_[k];
    }

    void grow()
    {
        slots_.assign(2 * slots_.size(), {});
        for (std::uint32_t k = 0; k < leaves_.size(); ++k) slot_of(leaves_[k]) = {leaves_[k], k};
    }

    std::vector<Slot> slots_;  // the size is a power of two
    std::vector<Coord> leaves_;
};

// A range of points and the leaves that it touches.
struct Block {
    std::size_t begin, end;
    std::vector<std::uint32_t> leaves;  // indexed by the leaf's number in this block
    std::vector<std::size_t> counts;    // points of this block per leaf
};

// Packs a point's index in the set and its voxel within the leaf.
std::int64_t entry(std::uint32_t voxel, std::size_t place)
{
    return static_cast<std::int64_t>(std::uint64_t{voxel} << 32 | place);
}

// Sorts the entries of one leaf by voxel, keeping their order within a voxel. sorted: scratch memory of the same size.
void sort_leaf(std::span<std::int64_t> entries, VdbLeaf& leaf, std::vector<std::int64_t>& sorted)
{
    std::array<std::uint32_t, 512> at{};
    for (const std::int64_t e : entries) ++at[static_cast<std::size_t>(e >> 32)];
    std::uint32_t first = 0;
    for (std::uint32_t voxel = 0; voxel < at.size(); ++voxel) {
        if (at[voxel] == 0) continue;
        leaf.voxels.setOn(voxel);
        leaf.counts.push_back(at[voxel]);
        first += std::exchange(at[voxel], first);
    }
    sorted.resize(entries.size());
    for (const std::int64_t e : entries) sorted[at[static_cast<std::size_t>(e >> 32)]++] = e;
    std::copy(sorted.begin(), sorted.end(), entries.begin());
}

// The blocks of a set, the leaves in tree order, and the number of each point's leaf within its block.
struct Lookup {
    std::vector<Block> blocks;
    Column<std::int32_t> numbers;
    std::vector<VdbLeaf> leaves;
};

Lookup look_up(const Strided<Vec3f>& P, std::size_t size, const Voxels& voxels)
{
    Lookup result{{}, Column<std::int32_t>(size), {}};
    const std::size_t of_block = std::max(min_block, (size + max_blocks - 1) / max_blocks);
    for (std::size_t begin = 0; begin < size; begin += of_block)
        result.blocks.push_back({begin, std::min(size, begin + of_block), {}, {}});
    const std::span<std::int32_t> numbers = result.numbers.overwrite();
    std::vector<std::vector<Coord>> found(result.blocks.size());
    tbb::parallel_for(std::size_t{0}, result.blocks.size(), [&](std::size_t b) {
        Block& block = result.blocks[b];
        LeafNumbers own;
        for (std::size_t i = block.begin; i < block.end; ++i) {
            const std::uint32_t number = own.add(leaf_of(voxels.of(P[i])));
            if (number == block.counts.size()) block.counts.push_back(0);
            ++block.counts[number];
            numbers[i] = static_cast<std::int32_t>(number);
        }
        found[b] = own.leaves();
        trim_columns();
    });

    LeafNumbers all;
    for (std::size_t b = 0; b < found.size(); ++b)
        for (const Coord& leaf : found[b]) result.blocks[b].leaves.push_back(all.add(leaf));
    std::vector<std::uint32_t> order(all.leaves().size()), rank(order.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return before_in_tree(all.leaves()[a], all.leaves()[b]); });
    for (std::uint32_t k = 0; k < order.size(); ++k) {
        rank[order[k]] = k;
        result.leaves.push_back({all.leaves()[order[k]]});
    }
    for (Block& block : result.blocks)
        for (std::size_t k = 0; k < block.leaves.size(); ++k) {
            block.leaves[k] = rank[block.leaves[k]];
            result.leaves[block.leaves[k]].size += static_cast<std::uint32_t>(block.counts[k]);
        }
    std::size_t first = 0;
    for (VdbLeaf& leaf : result.leaves) first += leaf.size, leaf.first = first - leaf.size;
    return result;
}

// Returns the entries of all points, in order.
Column<std::int64_t> sorted_entries(const Strided<Vec3f>& P, const Voxels& voxels, Lookup& lookup)
{
    Column<std::int64_t> result(0);
    const std::span<std::int64_t> entries = result.append_for_writing(lookup.numbers.size());
    // The next index for a block's points in each of its leaves.
    std::vector<std::size_t> next(lookup.leaves.size());
    for (std::size_t k = 0; k < next.size(); ++k) next[k] = lookup.leaves[k].first;
    for (Block& block : lookup.blocks)
        for (std::size_t k = 0; k < block.leaves.size(); ++k)
            block.counts[k] = std::exchange(next[block.leaves[k]], next[block.leaves[k]] + block.counts[k]);
    const Strided<std::int32_t> numbers = std::as_const(lookup.numbers).read();
    tbb::parallel_for(std::size_t{0}, lookup.blocks.size(), [&](std::size_t b) {
        Block& block = lookup.blocks[b];
        for (std::size_t i = block.begin; i < block.end; ++i)
            entries[block.counts[static_cast<std::size_t>(numbers[i])]++] = entry(place_in_leaf(voxels.of(P[i])), i);
    });
    PerWorker<std::vector<std::int64_t>> sorted;
    tbb::parallel_for(std::size_t{0}, lookup.leaves.size(), [&](std::size_t k) {
        VdbLeaf& leaf = lookup.leaves[k];
        sort_leaf(entries.subspan(leaf.first, leaf.size), leaf, sorted.local());
    });
    return result;
}

// Leaves that are sorted together.
struct Cell {
    std::size_t first_leaf, end_leaf, first, end;  // ranges of leaves and of points
};

std::vector<Cell> cells_of(const std::vector<VdbLeaf>& leaves)
{
    std::vector<Cell> cells;
    for (std::size_t k = 0; k < leaves.size(); ++k) {
        const std::size_t end = leaves[k].first + leaves[k].size;
        if (!cells.empty() && end - cells.back().first <= cell_points)
            cells.back().end_leaf = k + 1, cells.back().end = end;
        else
            cells.push_back({k, k + 1, leaves[k].first, end});
    }
    return cells;
}

// Points that are consecutive both before and after sorting.
struct Run {
    std::size_t from, to, size;
};

// How a range of points is distributed to cells: the order in which it is read, and the destinations of its runs.
struct Scatter {
    std::vector<std::uint32_t> order;  // indices in the range
    std::vector<Run> runs;             // `from` is an index in `order`
};

template <class T>
void read_column(const Strided<T>& column, std::size_t begin, std::size_t size, std::vector<T>& values)
{
    values.resize(size, Column<T>::zero());
    read_values(values.data(), column, begin, size);
}

// A column while it is reordered.
struct MovedColumn {
    // Distributes points, starting at `begin`, to cells.
    std::function<void(std::size_t begin, const Scatter& scatter)> scatter;
    // Replaces the points from `first` on by these, given as indices relative to `first`.
    std::function<void(std::size_t first, std::span<const std::int64_t> entries)> sort;
};

// A thread's part of a column, as read and in its new order.
template <class T>
struct Stretch {
    std::vector<T> read, moved;
};

// One per type of values.
template <class Any>
struct StretchesOf;
template <class... T>
struct StretchesOf<std::variant<Column<T>...>> {
    using Type = std::tuple<Stretch<T>..., Stretch<std::uint8_t>>;
};
using Stretches = PerWorker<StretchesOf<AnyColumn>::Type>;

template <class T>
MovedColumn moved(const Column<T>& column, Column<T>& into, Stretches& stretches)
{
    const std::span<T> to = into.append_for_writing(column.size());
    return {[from = column.read(), to, &stretches](std::size_t begin, const Scatter& scatter) {
                auto& [read, values] = std::get<Stretch<T>>(stretches.local());
                read_column(from, begin, scatter.order.size(), read);
                values.clear();
                for (const std::uint32_t i : scatter.order) values.push_back(read[i]);
                for (const Run& run : scatter.runs) write_values(&to[run.to], &values[run.from], run.size * sizeof(T));
            },
            [to, &stretches](std::size_t first, std::span<const std::int64_t> entries) {
                auto& [read, sorted] = std::get<Stretch<T>>(stretches.local());
                read_column({to.data(), 1}, first, entries.size(), read);
                sorted.clear();
                for (const std::int64_t e : entries) sorted.push_back(read[static_cast<std::uint32_t>(e)]);
                write_values(&to[first], sorted.data(), sorted.size() * sizeof(T));
            }};
}

// The next free index in each cell.
class CellEnds {
public:
    CellEnds(const std::vector<Cell>& cells, std::size_t leaves) : cell_of_(leaves)
    {
        for (const Cell& cell : cells) {
            std::fill(cell_of_.begin() + static_cast<std::ptrdiff_t>(cell.first_leaf),
                      cell_of_.begin() + static_cast<std::ptrdiff_t>(cell.end_leaf), next_.size());
            next_.push_back(cell.first);
        }
    }

    // numbers, leaves: the leaves of a range of points.
    void add(std::span<const std::int32_t> numbers, const std::vector<std::uint32_t>& leaves, Scatter& scatter)
    {
        const auto cell_of = [&](std::int32_t number) { return cell_of_[leaves[static_cast<std::size_t>(number)]]; };
        std::vector<std::size_t> at(next_.size());
        for (const std::int32_t number : numbers) ++at[cell_of(number)];
        scatter.runs.clear();
        std::size_t first = 0;
        for (std::size_t cell = 0; cell < at.size(); ++cell) {
            if (at[cell] == 0) continue;
            scatter.runs.push_back({first, next_[cell], at[cell]});
            next_[cell] += at[cell];
            first += std::exchange(at[cell], first);
        }
        scatter.order.resize(numbers.size());
        for (std::uint32_t i = 0; i < numbers.size(); ++i) scatter.order[at[cell_of(numbers[i])]++] = i;
    }

private:
    std::vector<std::size_t> cell_of_, next_;  // per leaf; per cell
};

// Returns the points in order: distributes them to cells, then sorts each cell.
PointSet sorted_points(const PointSet& points, const Voxels& voxels, Lookup& lookup)
{
    PointSet result;
    result.append(points.size());
    Stretches stretches;
    std::vector<MovedColumn> columns;
    for (const auto& [name, column] : points.columns())
        std::visit(
            [&, &key = name]<class T>(const Column<T>& c) {
                if (c.is_uniform()) return result.set(key, c);
                Column<T> into(0, c.fallback());
                columns.push_back(moved(c, into, stretches));
                result.set(key, std::move(into));
            },
            column);
    for (const auto& [name, members] : points.groups()) {
        if (members.is_uniform()) {
            result.group(name) = members;
            continue;
        }
        Column<std::uint8_t> into(0);
        columns.push_back(moved(members, into, stretches));
        result.group(name) = std::move(into);
    }

    const std::vector<Cell> cells = cells_of(lookup.leaves);
    CellEnds ends(cells, lookup.leaves.size());
    const Strided<std::int32_t> numbers = std::as_const(lookup.numbers).read();
    Scatter scatter;
    for (const Block& block : lookup.blocks)
        for (std::size_t begin = block.begin; begin < block.end; begin += stretch) {
            ends.add({numbers.data + begin, std::min(stretch, block.end - begin)}, block.leaves, scatter);
            tbb::parallel_for(std::size_t{0}, columns.size(),
                              [&](std::size_t c) { columns[c].scatter(begin, scatter); });
            trim_columns();
        }

    const Strided<Vec3f> P = std::as_const(result).P().read();
    PerWorker<std::vector<std::int64_t>> sorted;
    tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t c) {
        const Cell& cell = cells[c];
        LeafNumbers numbers_of;
        std::vector<std::size_t> at;
        for (std::size_t k = cell.first_leaf; k < cell.end_leaf; ++k) {
            numbers_of.add(lookup.leaves[k].origin);
            at.push_back(lookup.leaves[k].first - cell.first);
        }
        std::vector<Vec3f> P_of_cell;
        read_column(P, cell.first, cell.end - cell.first, P_of_cell);
        std::vector<std::int64_t> entries(P_of_cell.size());
        for (std::size_t i = 0; i < entries.size(); ++i) {
            const Coord voxel = voxels.of(P_of_cell[i]);
            entries[at[numbers_of[leaf_of(voxel)]]++] = entry(place_in_leaf(voxel), i);
        }
        for (std::size_t k = cell.first_leaf; k < cell.end_leaf; ++k) {
            VdbLeaf& leaf = lookup.leaves[k];
            sort_leaf(std::span(entries).subspan(leaf.first - cell.first, leaf.size), leaf, sorted.local());
        }
        for (const MovedColumn& column : columns) column.sort(cell.first, entries);
        trim_columns();
    });
    return result;
}

}  // namespace

VdbOrder::VdbOrder(const PointSet& points, double voxel) : is_sorted_(columns_lie_in_files())
{
    const Voxels voxels(voxel);
    const Strided<Vec3f> P = points.P().read();
    Lookup lookup = look_up(P, points.size(), voxels);
    if (is_sorted_) {
        points_ = sorted_points(points, voxels, lookup);
    } else {
        entries_ = sorted_entries(P, voxels, lookup);
        points_ = points;
    }
    leaves_ = std::move(lookup.leaves);
}

}  // namespace rapid

// Copying a level set's tree into the flat table of a BakedGrid.
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>

#include "runtime/shapes/level_set/level_set_grid.h"

namespace rapid {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using Accessor = openvdb::tree::ValueAccessor<const FloatTree, /*registered with the tree*/ false>;

constexpr int block = BakedGrid::block, edge = BakedGrid::edge;

// A block of the tree: a leaf's values, or one value.
struct Source {
    const float* values = nullptr;
    float constant = 0;

    float at(int i, int j, int k) const { return values ? values[(i * block + j) * block + k] : constant; }
};

Source source_at(const Accessor& accessor, const Coord& origin)
{
    if (const auto* leaf = accessor.probeConstLeaf(origin)) return {leaf->buffer().data(), 0};
    return {nullptr, accessor.getValue(origin)};
}

// The block at `origin` and its seven upper neighbours: bit 2 of the index is +x, bit 1 +y, bit 0 +z.
std::array<Source, 8> neighbourhood(const Accessor& accessor, const Coord& origin)
{
    std::array<Source, 8> sources;
    for (int n = 0; n < 8; ++n)
        sources[n] = source_at(accessor, origin.offsetBy((n & 4) * 2, (n & 2) * 4, (n & 1) * 8));
    return sources;
}

void copy_block(const std::array<Source, 8>& sources, float* into)
{
    for (int i = 0; i < edge; ++i)
        for (int j = 0; j < edge; ++j)
            for (int k = 0; k < edge; ++k)
                *into++ = sources[(i >> 3) << 2 | (j >> 3) << 1 | k >> 3].at(i & 7, j & 7, k & 7);
}

// What the cells of one block tell of the whole field, in voxels and metres per voxel.
struct Survey {
    Eigen::AlignedBox3i crossed;  // cells where the sign changes
    std::uint64_t crossings = 0;
    float steepest = 0;  // squared slope, m² per voxel²

    void join(const Survey& other)
    {
        crossed.extend(other.crossed);
        crossings += other.crossings;
        steepest = std::max(steepest, other.steepest);
    }
};

// In a trilinear cell each component of the gradient is affine along each axis, so its squared length is convex along
// each axis: the largest is at one of the cell's corners, where the components are the differences along the edges
// that meet there.
Survey survey_block(const float* values, const Eigen::Vector3i& first)
{
    Survey survey;
    constexpr int slab = edge * edge;
    for (int i = 0; i < block; ++i)
        for (int j = 0; j < block; ++j)
            for (int k = 0; k < block; ++k) {
                const float* c = values + i * slab + j * edge + k;
                float dx[2][2], dy[2][2], dz[2][2];
                int negative = 0;
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b) {
                        dx[a][b] = c[slab + a * edge + b] - c[a * edge + b];
                        dy[a][b] = c[a * slab + edge + b] - c[a * slab + b];
                        dz[a][b] = c[a * slab + b * edge + 1] - c[a * slab + b * edge];
                        negative += (c[a * slab + b * edge] < 0) + (c[a * slab + b * edge + 1] < 0);
                    }
                for (int x = 0; x < 2; ++x)
                    for (int y = 0; y < 2; ++y)
                        for (int z = 0; z < 2; ++z)
                            survey.steepest = std::max(survey.steepest,
                                                       dx[y][z] * dx[y][z] + dy[x][z] * dy[x][z] + dz[x][y] * dz[x][y]);
                if (negative != 0 && negative != 8) {
                    const Eigen::Vector3i cell = first + Eigen::Vector3i(i, j, k);
                    survey.crossed.extend(cell);
                    survey.crossed.extend(cell + Eigen::Vector3i::Ones());
                    ++survey.crossings;
                }
            }
    return survey;
}

// Writes into the empty blocks of the index how many lie between them and the nearest with values: the chessboard
// distance less one, by the two passes of Rosenfeld and Pfaltz (1966).
void count_blocks_between(BakedGrid& baked)
{
    const Eigen::Vector3i& n = baked.blocks;
    const auto pass = [&](int step) {
        const auto begin = [&](int axis) { return step > 0 ? 0 : n[axis] - 1; };
        const auto within = [&](int i, int axis) { return i >= 0 && i < n[axis]; };
        const auto at = [&](int x, int y, int z) -> std::int32_t& {
            return baked.index[(std::size_t(x) * n.y() + y) * n.z() + z];
        };
        for (int x = begin(0); within(x, 0); x += step)
            for (int y = begin(1); within(y, 1); y += step)
                for (int z = begin(2); within(z, 2); z += step) {
                    std::int32_t& code = at(x, y, z);
                    if (code >= 0) continue;
                    int nearest = step > 0 ? n.maxCoeff() : BakedGrid::between(code) + 1;
                    for (int neighbour = 0; neighbour < 13; ++neighbour) {  // those that the pass has been to
                        const int i = x + step * (neighbour / 9 - 1), j = y + step * (neighbour / 3 % 3 - 1),
                                  k = z + step * (neighbour % 3 - 1);
                        if (!within(i, 0) || !within(j, 1) || !within(k, 2)) continue;
                        const std::int32_t other = at(i, j, k);
                        nearest = std::min(nearest, other >= 0 ? 1 : BakedGrid::between(other) + 2);
                    }
                    code = (BakedGrid::is_outside(code) ? BakedGrid::outside : BakedGrid::inside) - 2 * (nearest - 1);
                }
    };
    pass(1);
    pass(-1);
}

}  // namespace

BakedGrid bake(const FloatGrid& grid)
{
    const FloatTree& tree = grid.tree();
    BakedGrid baked;
    baked.voxel = grid.voxelSize()[0];
    baked.background = grid.background();

    openvdb::CoordBBox leaves;
    if (!tree.evalLeafBoundingBox(leaves)) return baked;
    // Blocks below the lowest leaves hold the cells between them and the constant beyond.
    const Coord low = leaves.min().offsetBy(-block);
    const auto blocks = [&](int axis) { return (leaves.max()[axis] + 1 - low[axis]) / block; };
    baked.blocks = {blocks(0), blocks(1), blocks(2)};
    const auto place = grid.indexToWorld(low);
    baked.origin = {place[0], place[1], place[2]};

    const std::size_t in_slab = std::size_t(baked.blocks.y()) * baked.blocks.z();
    const auto block_origin = [&](std::size_t b) {
        const auto in = b % in_slab;
        return low.offsetBy(static_cast<int>(b / in_slab) * block,
                            static_cast<int>(in / std::size_t(baked.blocks.z())) * block,
                            static_cast<int>(in % std::size_t(baked.blocks.z())) * block);
    };
    baked.index.resize(in_slab * baked.blocks.x());
    std::vector<std::uint8_t> is_leaf(baked.index.size());
    tbb::parallel_for(0, baked.blocks.x(), [&](int x) {
        const Accessor accessor(tree);
        for (std::size_t b = x * in_slab; b < (x + 1) * in_slab; ++b) {
            const Source source = source_at(accessor, block_origin(b));
            is_leaf[b] = source.values != nullptr;
            baked.index[b] = source.at(0, 0, 0) < 0 ? BakedGrid::inside : BakedGrid::outside;
        }
    });

    // Which blocks have values of their own: leaves, and their lower neighbours where the cells between vary. Each slab
    // of x is numbered by itself, and moved up by those before it afterwards: the numbers depend on the grid alone.
    const auto above_is_leaf = [&](std::size_t b) {
        const int x = static_cast<int>(b / in_slab);
        const int y = static_cast<int>(b % in_slab / std::size_t(baked.blocks.z()));
        const int z = static_cast<int>(b % std::size_t(baked.blocks.z()));
        for (int n = 1; n < 8; ++n) {
            const int i = x + (n >> 2), j = y + (n >> 1 & 1), k = z + (n & 1);
            if (i < baked.blocks.x() && j < baked.blocks.y() && k < baked.blocks.z() &&
                is_leaf[(std::size_t(i) * baked.blocks.y() + j) * baked.blocks.z() + k])
                return true;
        }
        return false;
    };
    std::vector<std::int32_t> varying(baked.blocks.x() + 1, 0);
    tbb::parallel_for(0, baked.blocks.x(), [&](int x) {
        const Accessor accessor(tree);
        std::array<float, BakedGrid::block_values> values;
        for (std::size_t b = x * in_slab; b < (x + 1) * in_slab; ++b) {
            bool varies = is_leaf[b];
            if (!varies && above_is_leaf(b)) {
                copy_block(neighbourhood(accessor, block_origin(b)), values.data());
                varies = std::any_of(values.begin(), values.end(), [&](float v) { return v != values[0]; });
            }
            if (varies) baked.index[b] = varying[x + 1]++;
        }
    });
    for (int x = 0; x < baked.blocks.x(); ++x) varying[x + 1] += varying[x];
    count_blocks_between(baked);

    baked.values.resize(std::size_t(varying.back()) * BakedGrid::block_values);
    const Survey survey = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<int>(0, baked.blocks.x()), Survey(),
        [&](const tbb::blocked_range<int>& slabs, Survey sum) {
            const Accessor accessor(tree);
            for (std::size_t b = slabs.begin() * in_slab; b < slabs.end() * in_slab; ++b) {
                if (baked.index[b] < 0) continue;
                baked.index[b] += varying[b / in_slab];
                float* values = baked.values.data() + std::size_t(baked.index[b]) * BakedGrid::block_values;
                const Coord origin = block_origin(b);
                copy_block(neighbourhood(accessor, origin), values);
                const Coord first = origin - low;
                sum.join(survey_block(values, {first.x(), first.y(), first.z()}));
            }
            return sum;
        },
        [](Survey a, const Survey& b) {
            a.join(b);
            return a;
        });

    baked.slope = std::max(1.0, std::sqrt(double(survey.steepest)) / baked.voxel);
    baked.crossings = survey.crossings;
    if (survey.crossings > 0)
        baked.surface = Box3d(baked.origin + baked.voxel * survey.crossed.min().cast<double>(),
                              baked.origin + baked.voxel * survey.crossed.max().cast<double>());
    return baked;
}

}  // namespace rapid

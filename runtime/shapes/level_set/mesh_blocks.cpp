#include "runtime/shapes/level_set/mesh_blocks.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <tuple>

#include "runtime/base/parallel.h"
#include "runtime/math/simd.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"

namespace rapid {

static_assert(MeshBand::block == VoxelBlocks::edge && MeshBand::voxels == VoxelBlocks::voxels);

MeshPtr in_voxels(const Mesh& mesh, const VoxelFrame& frame)
{
    auto result = std::make_shared<Mesh>();
    result->triangles = mesh.triangles;
    result->positions.reserve(mesh.positions.size());
    for (const Vec3f& P : mesh.positions) result->positions.push_back(frame.to_voxels(P.cast<double>()).cast<float>());
    return result;
}

bool sign_by_windings(const RayCrossings& faces, const Eigen::Vector3i& lowest,
                      std::span<float, VoxelBlocks::voxels> distance, std::vector<RayCrossings::Crossing>& crossings)
{
    constexpr int edge = VoxelBlocks::edge;
    bool overlap = false;
    for (int y = 0; y < edge; ++y)
        for (int z = 0; z < edge; ++z) {
            faces.along_x(lowest.y() + y, lowest.z() + z, crossings);
            int windings = 0;
            auto beyond = crossings.rbegin();
            for (int x = edge - 1; x >= 0; --x) {
                for (; beyond != crossings.rend() && beyond->x > lowest.x() + x; ++beyond) {
                    overlap = overlap || (windings != 0 && windings + beyond->turn != 0);
                    windings += beyond->turn;
                }
                float& value = distance[(x * edge + y) * edge + z];
                value = std::copysign(value, windings != 0 ? -1.0f : 1.0f);
            }
        }
    return overlap;
}

MeshBlocks measure(const Mesh& mesh, const VoxelFrame& frame, double half_width)
{
    constexpr std::size_t part = 8, voxels = VoxelBlocks::voxels;
    MeshBlocks result{in_voxels(mesh, frame), {frame, half_width, {}, {}, {}}, {}};
    VoxelBlocks& blocks = result.blocks;
    const MeshBand band(*result.mesh, half_width / frame.voxel);
    blocks.resize(band.size());
    result.nearest.resize(band.size() * voxels);
    const auto nearest = [&](std::size_t b) {
        return std::span<std::int32_t, voxels>(result.nearest.data() + b * voxels, voxels);
    };
    for_each_chunk(
        band.size(),
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) {
                const std::span<float, voxels> values = blocks.of(b);
                blocks.coords[b] = band.origin(b) / VoxelBlocks::edge;
                band.measure(b, values, nearest(b));
                for (std::size_t v = 0; v < voxels; ++v) {
                    const bool is_near = nearest(b)[v] >= 0;
                    values[v] = is_near ? values[v] * static_cast<float>(frame.voxel) : blocks.background();
                    if (is_near) VoxelBlocks::mark(blocks.in_band[b], v);
                }
            }
        },
        part);
    blocks.drop_empty(
        [&](std::size_t from, std::size_t to) { std::copy_n(nearest(from).begin(), voxels, nearest(to).begin()); });
    result.nearest.resize(blocks.size() * voxels);

    const RayCrossings faces(result.mesh);
    std::atomic<bool> overlap = false;
    for_each_chunk(
        blocks.size(),
        [&](std::size_t begin, std::size_t end) {
            std::vector<RayCrossings::Crossing> crossings;
            for (std::size_t b = begin; b < end; ++b)
                if (sign_by_windings(faces, VoxelBlocks::edge * blocks.coords[b], blocks.of(b), crossings))
                    overlap = true;
        },
        part);
    result.overlap = overlap;
    return result;
}

namespace {

using BlockCoord = Eigen::Vector3i;
using Corners = std::array<Vec3d, 3>;

// Returns the corners of a triangle in an order that does not depend on its orientation.
Corners corners_of(const Mesh& mesh, std::int32_t triangle)
{
    Mesh::Triangle t = mesh.triangles[triangle];
    std::sort(t.begin(), t.end());
    return {mesh.positions[t[0]].cast<double>(), mesh.positions[t[1]].cast<double>(),
            mesh.positions[t[2]].cast<double>()};
}

// A triangle that may lie within the band of a block.
struct Near {
    BlockCoord block;
    std::int32_t triangle;

    bool operator<(const Near& other) const
    {
        return std::tie(block.x(), block.y(), block.z(), triangle) <
               std::tie(other.block.x(), other.block.y(), other.block.z(), other.triangle);
    }
};

// Finds the blocks whose band a triangle may touch.
class Descent {
public:
    Descent(const Corners& corners, double half_width)
        : prism_(corners[0], corners[1], corners[2]), half_width_(half_width)
    {
        Box3d bounds;
        for (const Vec3d& corner : corners) bounds.extend(corner);
        const auto block_of = [](const Vec3d& P) {
            return BlockCoord((P / MeshBand::block).array().floor().matrix().cast<int>());
        };
        lowest_ = block_of(bounds.min() - Vec3d::Constant(half_width));
        highest_ = block_of(bounds.max() + Vec3d::Constant(half_width));
    }

    void run(std::int32_t triangle, std::vector<Near>& found) const { descend(lowest_, highest_, triangle, found); }

private:
    void descend(const BlockCoord& low, const BlockCoord& high, std::int32_t triangle, std::vector<Near>& found) const
    {
        constexpr int block = MeshBand::block;
        const Vec3d first = block * low.cast<double>();
        const Vec3d last = block * high.cast<double>() + Vec3d::Constant(block - 1);  // voxels
        const double reach = half_width_ + 0.5 * (last - first).norm();
        if (prism_.square_at_least(0.5 * (first + last)) > reach * reach) return;
        int axis = 0;
        if ((high - low).maxCoeff(&axis) == 0) {
            found.push_back({low, triangle});
            return;
        }
        BlockCoord middle = high, beyond = low;
        middle[axis] = low[axis] + (high[axis] - low[axis]) / 2;
        beyond[axis] = middle[axis] + 1;
        descend(low, middle, triangle, found);
        descend(beyond, high, triangle, found);
    }

    Prism prism_;
    double half_width_;
    BlockCoord lowest_, highest_;
};

// A triangle in single precision, for distances from a row of voxels along z.
class FloatTriangle {
public:
    // corners: relative to the block's lowest voxel.
    explicit FloatTriangle(const Corners& corners)
    {
        const Vec3d n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        for (int k = 0; k < 3; ++k) {
            const Vec3d edge = corners[(k + 1) % 3] - corners[k];
            const double length2 = edge.squaredNorm();
            corner_[k] = corners[k].cast<float>();
            edge_[k] = edge.cast<float>();
            per_length2_[k] = length2 > 0 ? static_cast<float>(1 / length2) : 0.0f;
            // Normalised, so that single precision suffices whatever the triangle's size.
            outward_[k] = edge.cross(n).stableNormalized().cast<float>();
        }
        up_ = n.stableNormalized().cast<float>();
        if (up_.isZero(0)) lateral_ = std::numeric_limits<float>::infinity();
    }

    // Returns the squared distances of the voxels (x, y, 0) to (x, y, 7).
    Floats square_distances(float x, float y) const
    {
        constexpr Floats z = {0, 1, 2, 3, 4, 5, 6, 7};
        Floats to_edges, height{};
        FloatFlags outside{};
        for (int k = 0; k < 3; ++k) {
            const Vec3f& e = edge_[k];
            const Vec3f& o = outward_[k];
            const float px = x - corner_[k].x(), py = y - corner_[k].y();
            const Floats pz = z - corner_[k].z();
            Floats t = ((e.x() * px + e.y() * py) + e.z() * pz) * per_length2_[k];
            t = t > 0 ? t : Floats{};
            t = t < 1 ? t : Floats{} + 1;
            const Floats dx = px - e.x() * t, dy = py - e.y() * t, dz = pz - e.z() * t;
            const Floats square = dx * dx + dy * dy + dz * dz;
            to_edges = k == 0 ? square : square < to_edges ? square : to_edges;
            outside |= (o.x() * px + o.y() * py) + o.z() * pz > 0;
            if (k == 0) height = (up_.x() * px + up_.y() * py) + up_.z() * pz;
        }
        const Floats to_plane = height * height + lateral_;
        return (outside | (to_edges < to_plane)) ? to_edges : to_plane;
    }

private:
    Vec3f corner_[3], edge_[3], outward_[3], up_;
    float per_length2_[3];
    float lateral_ = 0;  // infinite if the triangle has no plane
};

float largest(const Floats& x)
{
    typedef float Four __attribute__((vector_size(16)));
    const Four a = __builtin_shufflevector(x, x, 0, 1, 2, 3), b = __builtin_shufflevector(x, x, 4, 5, 6, 7);
    const Four c = a > b ? a : b;
    return std::max(std::max(c[0], c[1]), std::max(c[2], c[3]));
}

// The nearest triangles of each row of a block, in single precision.
struct Rows {
    static constexpr int side = MeshBand::block;

    std::array<Floats, side * side> square;
    std::array<FloatFlags, side * side> nearest;
    std::array<float, side * side> farthest;  // largest squared distance in each row

    explicit Rows(float square_half_width)
    {
        square.fill(Floats{} + square_half_width);
        nearest.fill(FloatFlags{} - 1);
        farthest.fill(square_half_width);
    }

    void take(const Corners& corners, std::int32_t triangle, double half_width)
    {
        Box3d bounds;
        for (const Vec3d& corner : corners) bounds.extend(corner);
        const Vec3d low = bounds.min(), high = bounds.max();
        const auto first = [&](int axis) { return std::max(0.0, std::ceil(low[axis] - half_width)); };
        const auto last = [&](int axis) { return std::min(side - 1.0, std::floor(high[axis] + half_width)); };
        if (first(2) > last(2)) return;
        const FloatTriangle near(corners);
        for (auto x = static_cast<int>(first(0)); x <= last(0); ++x) {
            const double dx = std::max({low.x() - x, 0.0, x - high.x()});
            for (auto y = static_cast<int>(first(1)); y <= last(1); ++y) {
                const double dy = std::max({low.y() - y, 0.0, y - high.y()});
                const int r = side * x + y;
                if (dx * dx + dy * dy >= farthest[r]) continue;
                const Floats d = near.square_distances(static_cast<float>(x), static_cast<float>(y));
                const FloatFlags nearer = d < square[r];
                square[r] = nearer ? d : square[r];
                nearest[r] = nearer ? FloatFlags{} + triangle : nearest[r];
                farthest[r] = largest(square[r]);
            }
        }
    }
};

double distance_to(const Corners& corners, const Vec3d& P)
{
    return (nearest_point(P, corners[0], corners[1], corners[2]) - P).norm();
}

}  // namespace

MeshBand::MeshBand(const Mesh& mesh, double half_width) : mesh_(mesh), half_width_(half_width)
{
    constexpr std::size_t part = 1024;
    const std::size_t triangles = mesh.triangles.size();
    std::vector<std::vector<Near>> parts((triangles + part - 1) / part);
    for_each_chunk(
        triangles,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t) {
                const auto triangle = static_cast<std::int32_t>(t);
                Descent(corners_of(mesh, triangle), half_width).run(triangle, parts[begin / part]);
            }
        },
        part);
    std::vector<Near> all;
    for (std::vector<Near>& of_part : parts) {
        all.insert(all.end(), of_part.begin(), of_part.end());
        std::vector<Near>().swap(of_part);
    }
    tbb::parallel_sort(all.begin(), all.end());
    triangles_.reserve(all.size());
    for (const Near& near : all) {
        if (blocks_.empty() || blocks_.back().coord != near.block)
            blocks_.push_back({near.block, triangles_.size(), triangles_.size()});
        triangles_.push_back(near.triangle);
        ++blocks_.back().end;
    }
}

void MeshBand::measure(std::size_t b, std::span<float, voxels> distance, std::span<std::int32_t, voxels> nearest) const
{
    const Vec3d from = origin(b).cast<double>();
    const auto corners_from_here = [&](std::int32_t triangle) {
        Corners corners = corners_of(mesh_, triangle);
        for (Vec3d& corner : corners) corner -= from;
        return corners;
    };
    // The margin covers the rounding of single precision.
    Rows rows(static_cast<float>(half_width_ * half_width_ * (1 + 1e-4)));
    for (std::size_t i = blocks_[b].first; i < blocks_[b].end; ++i)
        rows.take(corners_from_here(triangles_[i]), triangles_[i], half_width_);
    for (std::size_t v = 0; v < voxels; ++v) {
        nearest[v] = rows.nearest[v / block][v % block];
        double d = half_width_;
        if (nearest[v] >= 0) {
            const auto at = static_cast<int>(v);
            d = distance_to(corners_from_here(nearest[v]), Vec3d(at / (block * block), at / block % block, at % block));
        }
        if (d >= half_width_) d = half_width_, nearest[v] = -1;
        distance[v] = static_cast<float>(d);
    }
}

}  // namespace rapid

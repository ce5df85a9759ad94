#include "runtime/shapes/level_set/grid_of_points.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/open_grids.h"

namespace rapid {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

constexpr int leaf_edge = 8;  // voxels

// A point that reaches into a leaf. x, y, z: index of the leaf along each axis.
struct Reach {
    std::int32_t x, y, z;
    std::uint32_t point;

    bool same_leaf(const Reach& other) const { return x == other.x && y == other.y && z == other.z; }
    auto operator<=>(const Reach&) const = default;
};

// The voxels within a point's radius, and the share that each gets.
class Spread {
public:
    explicit Spread(const SpreadPoints& points) : points_(points) {}

    std::size_t size() const { return points_.P.size(); }
    float weight(std::size_t i) const { return points_.weight[points_.weight.size() == 1 ? 0 : i]; }
    // Returns the radius in voxels, at least 1: a smaller one might reach no voxel centre.
    double radius(std::size_t i) const { return std::max(1.0, given_radius(i) / points_.voxel); }
    Vec3d position(std::size_t i) const { return points_.P[i].cast<double>() / points_.voxel; }

    void check(std::size_t i) const
    {
        const double r = radius(i);
        if (!points_.P[i].allFinite() || !(position(i).cwiseAbs().maxCoeff() + r < (1 << 30)))
            throw Error(fmt::format(
                "point {} is at ({}, {}, {}); a position must be finite and within 2^30 voxels of the origin", i,
                points_.P[i].x(), points_.P[i].y(), points_.P[i].z()));
        if (!(given_radius(i) > 0) || !std::isfinite(r))
            throw Error(
                fmt::format("point {} has the radius {:g} m; it must be finite and above 0", i, given_radius(i)));
        if (!(weight(i) >= 0) || !std::isfinite(weight(i)))
            throw Error(fmt::format("point {} has the weight {:g}; it must be finite and at least 0", i, weight(i)));
    }

    Eigen::Vector3i first(std::size_t i) const { return (position(i).array() - radius(i)).ceil().cast<int>().matrix(); }
    Eigen::Vector3i last(std::size_t i) const { return (position(i).array() + radius(i)).floor().cast<int>().matrix(); }

    // Calls f(voxel, numerator of W) for the voxels of a point that lie in a box, z fastest.
    template <class F>
    void visit(std::size_t i, const Eigen::Vector3i& low, const Eigen::Vector3i& high, const F& f) const
    {
        const Eigen::Vector3i from = first(i).cwiseMax(low), to = last(i).cwiseMin(high);
        const Vec3d P = position(i);
        const double per_square = 1 / (radius(i) * radius(i));
        Eigen::Vector3i at;
        for (at.x() = from.x(); at.x() <= to.x(); ++at.x())
            for (at.y() = from.y(); at.y() <= to.y(); ++at.y())
                for (at.z() = from.z(); at.z() <= to.z(); ++at.z()) {
                    const double rest = 1 - (at.cast<double>() - P).squaredNorm() * per_square;
                    if (rest > 0) f(at, rest * rest * rest);
                }
    }

    // Returns w_i / S_i.
    double share(std::size_t i) const
    {
        double sum = 0;
        visit(i, first(i), last(i), [&](const Eigen::Vector3i&, double part) { sum += part; });
        return weight(i) / sum;
    }

private:
    double given_radius(std::size_t i) const { return points_.radius[points_.radius.size() == 1 ? 0 : i]; }

    const SpreadPoints& points_;
};

Eigen::Vector3i leaf_of(const Eigen::Vector3i& voxel)
{
    return voxel.unaryExpr([](int x) { return x >> 3; });
}

void require_memory(const Spread& points, double bytes)
{
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("a grid of {} points", points.size()), bytes,
                              "give a larger voxel or a smaller radius");
}

// Finds which points reach into which leaves, sorted by leaf, then by point. Skips points of weight 0.
std::vector<Reach> reaches_of(const Spread& points)
{
    std::vector<std::size_t> begin(points.size() + 1, 0);
    for_each_chunk(points.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            points.check(i);
            if (points.weight(i) == 0) continue;
            const Eigen::Vector3i leaves = leaf_of(points.last(i)) - leaf_of(points.first(i)) + Eigen::Vector3i::Ones();
            begin[i + 1] = static_cast<std::size_t>(leaves.cast<std::int64_t>().prod());
        }
    });
    double count = 0;
    for (const std::size_t leaves : begin) count += static_cast<double>(leaves);
    require_memory(points, count * sizeof(Reach));
    std::partial_sum(begin.begin(), begin.end(), begin.begin());

    std::vector<Reach> reaches(begin.back());
    for_each_chunk(points.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            if (begin[i] == begin[i + 1]) continue;
            const Eigen::Vector3i from = leaf_of(points.first(i)), to = leaf_of(points.last(i));
            std::size_t at = begin[i];
            for (int x = from.x(); x <= to.x(); ++x)
                for (int y = from.y(); y <= to.y(); ++y)
                    for (int z = from.z(); z <= to.z(); ++z) reaches[at++] = {x, y, z, static_cast<std::uint32_t>(i)};
        }
    });
    tbb::parallel_sort(reaches.begin(), reaches.end());
    return reaches;
}

// The sums of one leaf: Σ w W, and Σ w W v for vectors. A voxel's index in them is x 64 + y 8 + z.
struct Sums {
    std::vector<double> weight = std::vector<double>(leaf_edge * leaf_edge * leaf_edge);
    std::vector<Vec3d> vectors = {};
};

Sums sums_of(const Spread& points, const SpreadPoints& given, std::span<const double> shares,
             std::span<const Reach> reaches)
{
    Sums sums;
    if (!given.vectors.empty()) sums.vectors.assign(sums.weight.size(), Vec3d::Zero());
    const Reach& leaf = reaches.front();
    const Eigen::Vector3i low = Eigen::Vector3i(leaf.x, leaf.y, leaf.z) * leaf_edge;
    const Eigen::Vector3i high = low + Eigen::Vector3i::Constant(leaf_edge - 1);
    for (const Reach& reach : reaches) {
        const double share = shares[reach.point];
        const auto add = [&](const Eigen::Vector3i& voxel, double part) {
            const Eigen::Vector3i at = voxel - low;
            const auto position = static_cast<std::size_t>((at.x() * leaf_edge + at.y()) * leaf_edge + at.z());
            sums.weight[position] += share * part;
            if (!sums.vectors.empty())
                sums.vectors[position] += share * part * given.vectors[reach.point].cast<double>();
        };
        points.visit(reach.point, low, high, add);
    }
    return sums;
}

// Builds a grid that has value(sums, index) in every voxel that a point reaches.
template <class Grid, class F>
typename Grid::Ptr grid_of(const SpreadPoints& given, const char* name, const F& value)
{
    using Leaf = typename Grid::TreeType::LeafNodeType;
    if (given.P.empty()) throw Error("a grid needs points, and there are none");
    initialize_openvdb();
    const Spread points(given);
    const std::vector<Reach> reaches = reaches_of(points);
    std::vector<double> shares(points.size());
    for_each_chunk(points.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) shares[i] = points.weight(i) > 0 ? points.share(i) : 0;
    });

    std::vector<std::size_t> leaves;  // start of each leaf in `reaches`
    for (std::size_t i = 0; i < reaches.size(); ++i)
        if (i == 0 || !reaches[i].same_leaf(reaches[i - 1])) leaves.push_back(i);
    require_memory(points, static_cast<double>(leaves.size()) * sizeof(typename Leaf::ValueType) * Leaf::SIZE);
    std::vector<std::unique_ptr<Leaf>> made(leaves.size());
    const auto make = [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t end = k + 1 < leaves.size() ? leaves[k + 1] : reaches.size();
            const auto those = std::span(reaches).subspan(leaves[k], end - leaves[k]);
            const Sums sums = sums_of(points, given, shares, those);
            const Reach& at = those.front();
            made[k] = std::make_unique<Leaf>(Coord(at.x * leaf_edge, at.y * leaf_edge, at.z * leaf_edge));
            for (std::size_t position = 0; position < sums.weight.size(); ++position)
                if (sums.weight[position] > 0)
                    made[k]->setValueOn(static_cast<openvdb::Index>(position), value(sums, position));
        }
    };
    for_each_chunk(leaves.size(), make, /*size=*/16);

    auto grid = Grid::create();
    for (auto& leaf : made)
        if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
    grid->setTransform(openvdb::math::Transform::createLinearTransform(given.voxel));
    grid->setName(name);
    return grid;
}

DensityGridPtr density(const SpreadPoints& points)
{
    const double volume = points.voxel * points.voxel * points.voxel;
    auto grid = grid_of<FloatGrid>(points, "density", [&](const Sums& sums, std::size_t position) {
        return static_cast<float>(sums.weight[position] / volume);
    });
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return std::make_shared<OpenDensityGrid>(grid);
}

VectorGridPtr vectors(const SpreadPoints& points)
{
    return std::make_shared<OpenVectorGrid>(
        grid_of<Vec3SGrid>(points, "v", [](const Sums& sums, std::size_t position) -> openvdb::Vec3s {
            const Vec3d mean = sums.vectors[position] / sums.weight[position];
            return openvdb::Vec3s(openvdb::Vec3d(mean.x(), mean.y(), mean.z()));
        }));
}

RAPID_DEFINE(density_of_points, density);
RAPID_DEFINE(vectors_of_points, vectors);

}  // namespace
}  // namespace rapid

#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/grid_of_points.h"

#include <openvdb/io/File.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numeric>

#include "runtime/base/error.h"
#include "runtime/math/random.h"
#include "runtime/shapes/level_set/open_grids.h"
#include "runtime/shapes/level_set/write_grids.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Contains;

namespace {

struct Cloud {
    std::vector<Vec3f> P, v;
    std::vector<float> radius, weight;

    SpreadPoints density(double voxel) const { return {P, radius, weight, {}, voxel}; }
    SpreadPoints vectors(double voxel) const { return {P, radius, weight, v, voxel}; }
};

Cloud random_cloud(std::size_t count, double largest_radius)
{
    Cloud cloud;
    for (std::size_t i = 0; i < count; ++i) {
        const auto a = uniform4(RandomKey{}, i, 0), b = uniform4(RandomKey{}, i, 1);
        cloud.P.push_back(Vec3d(3 * a[0] - 2, 2 * a[1] - 1, a[2]).cast<float>());
        cloud.v.push_back(Vec3d(b[0] - 0.5, b[1], -b[2]).cast<float>());
        cloud.radius.push_back(static_cast<float>(0.1 + (largest_radius - 0.1) * a[3]));
        cloud.weight.push_back(static_cast<float>(b[3] < 0.1 ? 0 : b[3]));
    }
    return cloud;
}

const openvdb::FloatGrid& tree_of(const DensityGridPtr& fog)
{
    return *dynamic_cast<const OpenDensityGrid&>(*fog).grid();
}
const openvdb::Vec3SGrid& tree_of(const VectorGridPtr& grid)
{
    return *dynamic_cast<const OpenVectorGrid&>(*grid).grid();
}

// Evaluates the sums of the formula for one voxel over all points.
double by_hand(const Cloud& cloud, double voxel, const Vec3d& at, Vec3d* mean)
{
    double sum = 0;
    Vec3d vectors = Vec3d::Zero();
    for (std::size_t i = 0; i < cloud.P.size(); ++i) {
        const Vec3d P = cloud.P[i].cast<double>();
        const auto part = [&](const Vec3d& x) {
            const double rest = 1 - (x - P).squaredNorm() / std::pow(double(cloud.radius[i]), 2);
            return rest > 0 ? rest * rest * rest : 0;
        };
        if (part(at) == 0) continue;
        double all = 0;
        const int reach = static_cast<int>(std::ceil(cloud.radius[i] / voxel)) + 1;
        const Eigen::Vector3i middle = (P / voxel).array().round().cast<int>().matrix();
        for (int x = -reach; x <= reach; ++x)
            for (int y = -reach; y <= reach; ++y)
                for (int z = -reach; z <= reach; ++z)
                    all += part((middle + Eigen::Vector3i(x, y, z)).cast<double>() * voxel);
        const double share = cloud.weight[i] * part(at) / all;
        sum += share;
        vectors += share * cloud.v[i].cast<double>();
    }
    if (sum > 0) *mean = vectors / sum;
    return sum / std::pow(voxel, 3);
}

}  // namespace

TEST_CASE("a density holds the weights of its points, and vectors keep their sum", "[grid_of_points]")
{
    const double voxel = 0.1;
    const Cloud cloud = random_cloud(3000, 0.35);
    const DensityGridPtr fog = density_of_points(cloud.density(voxel));
    const VectorGridPtr grid = vectors_of_points(cloud.vectors(voxel));

    double weights = 0;
    Vec3d momentum = Vec3d::Zero(), found = Vec3d::Zero();
    for (std::size_t i = 0; i < cloud.P.size(); ++i) {
        weights += cloud.weight[i];
        momentum += double(cloud.weight[i]) * cloud.v[i].cast<double>();
    }
    CHECK(fog->total() == Approx(weights).epsilon(1e-6));

    const auto vectors = tree_of(grid).getConstAccessor();
    for (auto value = tree_of(fog).cbeginValueOn(); value; ++value) {
        const openvdb::Vec3s v = vectors.getValue(value.getCoord());
        found += std::pow(voxel, 3) * double(*value) * Vec3d(v.x(), v.y(), v.z());
    }
    CHECK((found - momentum).norm() < 1e-5 * momentum.norm());
    CHECK(tree_of(fog).activeVoxelCount() == tree_of(grid).activeVoxelCount());
}

TEST_CASE("each voxel has the sum over all points, added one by one", "[grid_of_points]")
{
    const double voxel = 0.09;
    const Cloud cloud = random_cloud(400, 0.4);
    const auto density = tree_of(density_of_points(cloud.density(voxel))).deepCopy();
    const auto vectors = tree_of(vectors_of_points(cloud.vectors(voxel))).deepCopy();
    for (int k = 0; k < 400; ++k) {
        const auto u = uniform4(RandomKey{}, static_cast<std::uint64_t>(k), 7);
        const Eigen::Vector3i at =
            (Vec3d(3 * u[0] - 2, 2 * u[1] - 1, u[2]) / voxel).array().round().cast<int>().matrix();
        Vec3d mean = Vec3d::Zero();
        const double expected = by_hand(cloud, voxel, at.cast<double>() * voxel, &mean);
        const openvdb::Coord coord(at.x(), at.y(), at.z());
        CHECK(density->tree().getValue(coord) == Approx(expected).epsilon(1e-5).margin(1e-6));
        const openvdb::Vec3s v = vectors->tree().getValue(coord);
        CHECK((Vec3d(v.x(), v.y(), v.z()) - mean).norm() < 1e-5);
    }
}

TEST_CASE("the same bits on any number of threads", "[grid_of_points][threads]")
{
    const Cloud cloud = random_cloud(20000, 0.3);
    const auto values_on = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const DensityGridPtr fog = density_of_points(cloud.density(0.1));
        const VectorGridPtr grid = vectors_of_points(cloud.vectors(0.1));
        std::vector<float> values;
        for (auto value = tree_of(fog).cbeginValueOn(); value; ++value) values.push_back(*value);
        for (auto value = tree_of(grid).cbeginValueOn(); value; ++value)
            for (int axis = 0; axis < 3; ++axis) values.push_back((*value)[axis]);
        return values;
    };
    const std::vector<float> one = values_on(1);
    CHECK(one == values_on(2));
    CHECK(one == values_on(7));
}

TEST_CASE("vectors that are all alike are so everywhere that a point reaches", "[grid_of_points]")
{
    Cloud cloud = random_cloud(500, 0.3);
    std::fill(cloud.v.begin(), cloud.v.end(), Vec3f(1, -2, 0.5f));
    const VectorGridPtr grid = vectors_of_points(cloud.vectors(0.1));
    for (auto value = tree_of(grid).cbeginValueOn(); value; ++value)
        CHECK((Vec3f(value->x(), value->y(), value->z()) - Vec3f(1, -2, 0.5f)).norm() < 1e-6f);
}

TEST_CASE("a fog and a vector grid in one file are read back bit-identical", "[grid_of_points]")
{
    const test::TemporaryFolder folder;
    const Cloud cloud = random_cloud(500, 0.3);
    const DensityGridPtr fog = density_of_points(cloud.density(0.1));
    const VectorGridPtr grid = vectors_of_points(cloud.vectors(0.1));
    write_grids(folder / "smoke.vdb", {{"density", fog}, {"vel", grid}});
    const DensityGridPtr read_fog = read_density_grid(folder / "smoke.vdb", "");
    const VectorGridPtr read_grid = read_vector_grid(folder / "smoke.vdb", "vel");
    for (int k = 0; k < 200; ++k) {
        const auto u = uniform4(RandomKey{}, static_cast<std::uint64_t>(k), 3);
        const Vec3d P(3 * u[0] - 2, 2 * u[1] - 1, u[2]);
        double a = 0, b = 1;
        Vec3d c, d = Vec3d::Ones();
        fog->sample({&P, 1}, {&a, 1}), read_fog->sample({&P, 1}, {&b, 1});
        grid->sample({&P, 1}, {&c, 1}), read_grid->sample({&P, 1}, {&d, 1});
        CHECK(a == b);
        CHECK(c == d);
    }
}

TEST_CASE("points that make no grid are refused", "[grid_of_points]")
{
    const std::vector<Vec3f> P = {Vec3f(0, 0, 0), Vec3f(1, 0, 0)}, none;
    const std::vector<float> all = {0.1f}, weight = {1}, negative = {1, -1}, zero = {0};
    const auto refused = [](const SpreadPoints& points) { return test::error_of([&] { density_of_points(points); }); };
    CHECK_THAT(refused({none, all, weight, {}, 0.1}), Contains("needs points, and there are none"));
    CHECK_THAT(refused({P, all, negative, {}, 0.1}), Contains("point 1 has the weight -1"));
    CHECK_THAT(refused({P, all, zero, {}, 0.1}), Contains("no density above 0"));
    const std::vector<Vec3f> far = {Vec3f(1e30f, 0, 0)};
    CHECK_THAT(refused({far, all, weight, {}, 0.1}), Contains("within 2^30 voxels"));
}

#include <openvdb/tools/Interpolation.h>

#include <cmath>
#include <random>

#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// Returns a field that is not a distance: random values in a block of voxels, and a constant around it.
openvdb::FloatGrid::Ptr noise(float background)
{
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(background);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
    std::mt19937 random(3);
    std::uniform_real_distribution<float> value(-background, background);
    auto accessor = grid->getAccessor();
    for (int i = -3; i <= 13; ++i)
        for (int j = -11; j <= 2; ++j)
            for (int k = 5; k <= 16; ++k) accessor.setValue({i, j, k}, value(random));
    return grid;
}

}  // namespace

TEST_CASE("a baked grid agrees with OpenVDB's own sampler, across blocks and at the edge of the band", "[level set]")
{
    const auto grid = noise(1.0f);
    const BakedGrid baked = bake(*grid);
    const BakedSampler sampler(baked);
    const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> theirs(*grid);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> place(-6, 20);
    int inside = 0;
    for (int n = 0; n < 100'000; ++n) {
        const Vec3d x(place(random), place(random) - 10, place(random));  // in voxels
        const double expected = theirs.isSample(openvdb::Vec3d(x.x(), x.y(), x.z()));
        if (expected == 1.0) {
            REQUIRE(sampler.distance(x * 0.25) >= 1.0);  // outside the values: at least the background
            continue;
        }
        Vec3d gradient = Vec3d::Zero();
        REQUIRE(sampler.distance(x * 0.25) == Approx(expected).margin(1e-6));
        REQUIRE(sampler.distance(x * 0.25, gradient) == Approx(expected).margin(1e-6));
        REQUIRE(gradient.norm() <= sampler.slope_bound() * (1 + 1e-5));
        ++inside;
    }
    CHECK(inside > 10'000);
}

TEST_CASE("a baked grid's gradient is the derivative of its distance within a cell", "[level set]")
{
    const auto grid = noise(1.0f);
    const BakedGrid baked = bake(*grid);
    const BakedSampler sampler(baked);
    std::mt19937_64 random(6);
    std::uniform_int_distribution<int> cell(-3, 2);
    std::uniform_real_distribution<double> place(0.1, 0.9);
    for (int n = 0; n < 1000; ++n) {
        const Vec3d P = 0.25 * Vec3d(cell(random) + place(random), cell(random) - 4 + place(random),
                                     cell(random) + 10 + place(random));
        Vec3d gradient = Vec3d::Zero();
        sampler.distance(P, gradient);
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3d step = 0.02 * Vec3d::Unit(axis);  // the interpolant is affine along an axis: exact
            const double difference = (sampler.distance(P + step) - sampler.distance(P - step)) / 0.04;
            REQUIRE(gradient[axis] == Approx(difference).margin(2e-5));
        }
    }
}

TEST_CASE("the slope bound of a cell with one voxel raised is that of its steepest corner", "[level set]")
{
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(2.0f);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    grid->getAccessor().setValue({3, 3, 3}, -1.0f);
    const BakedGrid baked = bake(*grid);
    CHECK(baked.slope == Approx(std::sqrt(3.0) * 3 / 0.5));  // at the voxel all three differences are 3 per 0.5 m
    CHECK(baked.crossings == 8);
    CHECK_THAT(baked.surface.min(), rapid::test::close_to(Vec3d{1, 1, 1}, 0));
    CHECK_THAT(baked.surface.max(), rapid::test::close_to(Vec3d{2, 2, 2}, 0));
}

TEST_CASE("a baked sphere takes no more than 1.8 times its leaves' values", "[level set]")
{
    const auto sphere = level_set_sphere(1, Vec3d::Zero(), {0.02, 3});
    const auto& grid = dynamic_cast<const BakedLevelSet&>(*sphere);
    CHECK(grid.baked().bytes() < 1.8 * 2048 * grid_of(grid).tree().leafCount());
    CHECK(grid.baked().slope < 1.02);  // the shells between blocks have no steps
}

TEST_CASE("an empty grid bakes to one that is outside everywhere", "[level set]")
{
    openvdb::initialize();
    const BakedGrid baked = bake(*openvdb::FloatGrid::create(1.0f));
    CHECK(baked.crossings == 0);
    CHECK(BakedSampler(baked).distance({1, 2, 3}) >= 1.0);
}

TEST_CASE("distances of many points are bit-identical to those of single points", "[level set]")
{
    const auto shape = GENERATE(0, 1);
    const auto sphere = level_set_sphere(1, {0.3, -0.2, 5}, {0.05, 3});
    const BakedGrid baked = shape == 0 ? bake(*noise(1.0f)) : dynamic_cast<const BakedLevelSet&>(*sphere).baked();
    const BakedSampler sampler(baked);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> place(-3, 7);
    for (const int n : {1, 7, BakedSampler::many}) {
        for (int round = 0; round < 300; ++round) {
            double X[BakedSampler::many], Y[BakedSampler::many], Z[BakedSampler::many], phi[BakedSampler::many];
            for (int i = 0; i < n; ++i) {
                X[i] = place(random), Y[i] = place(random) - 2, Z[i] = place(random) + 2;
            }
            sampler.distances(n, X, Y, Z, phi);
            for (int i = 0; i < n; ++i) REQUIRE(phi[i] == sampler.distance({X[i], Y[i], Z[i]}));
        }
    }
}

TEST_CASE("beyond the band the distance is a bound of the right sign, larger than the half width", "[level set]")
{
    const double radius = 2, voxel = 0.05, half_width = 3 * voxel;
    const Vec3d center{0.3, -0.2, 5};
    const auto sphere = level_set_sphere(radius, center, {voxel, 3});
    const BakedSampler sampler(dynamic_cast<const BakedLevelSet&>(*sphere).baked());
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> offset(-3, 3);
    double largest = 0;
    for (int n = 0; n < 100'000; ++n) {
        const Vec3d d(offset(random), offset(random), offset(random));
        const double exact = d.norm() - radius, bound = sampler.distance(center + d);
        if (std::abs(exact) <= half_width) continue;
        REQUIRE(bound * exact > 0);
        REQUIRE(std::abs(bound) <= std::abs(exact) + 1e-3);  // the field differs from the sphere by at most 1e-3
        largest = std::max(largest, -bound);
    }
    CHECK(largest > radius / 3);
}

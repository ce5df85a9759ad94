#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/density_grid.h"

#include <openvdb/io/File.h>

#include <cmath>

#include "runtime/base/error.h"
#include "runtime/files/skipped_contents.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

struct DensityFolder : TemporaryFolder {
    DensityFolder() { openvdb::initialize(); }

    DensityGridPtr read(const openvdb::GridPtrVec& grids, const std::string& name = "") const
    {
        openvdb::io::File((*this / "fog.vdb").string()).write(grids);
        return read_density_grid(*this / "fog.vdb", name);
    }
    // Returns the error without the file's name.
    std::string error(const openvdb::GridPtrVec& grids, const std::string& name = "") const
    {
        return error_of([&] { read(grids, name); });
    }
};

openvdb::FloatGrid::Ptr fog(const char* name = "density")
{
    auto grid = openvdb::FloatGrid::create();
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return grid;
}

std::vector<Vec3f> births_in(const DensityGrid& grid, std::size_t n)
{
    std::vector<Birthplace> out(n);
    grid.scatter()->place(RandomKey(1, "emit1"), 0, out);
    std::vector<Vec3f> positions;
    for (const Birthplace& birth : out) {
        CHECK(birth.element == -1);
        positions.push_back(birth.P);
    }
    return positions;
}

}  // namespace

TEST_CASE("births in a fog are as many at each voxel as its density says, spread by its hat", "[density_grid]")
{
    const DensityFolder folder;
    const auto grid = fog();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    grid->tree().setValue({0, 0, 0}, 1.0f);
    grid->tree().setValue({10, 2, -4}, 3.0f);
    grid->tree().setValue({5, 5, 5}, 0.0f);
    constexpr std::size_t n = 40'000;
    std::size_t dense = 0;
    Vec3d sum = Vec3d::Zero(), squares = Vec3d::Zero();
    for (const Vec3f& P : births_in(*folder.read({grid}), n)) {
        const bool at_dense = P.x() > 2.5f;
        dense += at_dense;
        const Vec3d away = P.cast<double>() - (at_dense ? Vec3d(5, 1, -2) : Vec3d(0, 0, 0));
        CHECK(away.cwiseAbs().maxCoeff() <= 0.5);
        sum += away;
        squares += away.cwiseProduct(away);
    }
    CHECK(std::abs(double(dense) - 0.75 * n) < 5 * std::sqrt(n * 0.75 * 0.25));
    // A hat function of half width h has mean 0, variance h²/6, and variance 7 h⁴/180 of the squared offset.
    const double h = 0.5, variance = h * h / 6;
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(std::abs(sum[axis] / n) < 5 * std::sqrt(variance / n));
        CHECK(std::abs(squares[axis] / n - variance) < 5 * std::sqrt(7 * std::pow(h, 4) / 180 / n));
    }
}

TEST_CASE("a tile of a fog emits as its voxels would", "[density_grid]")
{
    const DensityFolder folder;
    const auto grid = fog();
    grid->tree().addTile(1, {0, 0, 0}, 2.0f, true);  // 8 voxels per edge
    grid->tree().setValue({100, 0, 0}, 1024.0f);     // as dense as the whole tile
    constexpr std::size_t n = 40'000;
    std::size_t in_tile = 0;
    Vec3d sum = Vec3d::Zero();
    for (const Vec3f& P : births_in(*folder.read({grid}), n)) {
        if (P.x() > 50) continue;
        ++in_tile;
        sum += P.cast<double>();
    }
    CHECK(std::abs(double(in_tile) - 0.5 * n) < 5 * std::sqrt(n * 0.25));
    // For voxels 0 to 7 the mean is 3.5, and the variance is (8² - 1)/12 plus that of the hat.
    const double deviation = std::sqrt((63.0 / 12 + 1.0 / 6) / double(in_tile));
    for (int axis = 0; axis < 3; ++axis) CHECK(std::abs(sum[axis] / double(in_tile) - 3.5) < 5 * deviation);
}

TEST_CASE("a file without a fog is an error that lists the grids of the file", "[density_grid]")
{
    const DensityFolder folder;
    const auto one = fog("smoke"), other = fog("heat"), negative = fog(), empty = fog();
    for (const auto& grid : {one, other}) grid->tree().setValue({0, 0, 0}, 1.0f);
    negative->tree().setValue({1, 2, 3}, -1.0f);
    empty->tree().setValue({1, 2, 3}, 0.0f);
    const auto surface = fog("surface");
    surface->setGridClass(openvdb::GRID_LEVEL_SET);
    CHECK_THAT(folder.error({one, other}),
               Catch::Contains("there are 2 fogs") && Catch::Contains("choose one with grid"));
    CHECK(births_in(*folder.read({one, other}, "heat"), 1).size() == 1);
    CHECK_THAT(folder.error({one}, "smok"), Catch::Contains("did you mean \"smoke\"?"));
    CHECK_THAT(folder.error({surface}), Catch::Contains("there is no fog of floats"));
    CHECK_THAT(folder.error({surface}, "surface"),
               Catch::Contains("is a level set of float; it must be a fog of floats; rapid.levelset.read reads level"));
    CHECK_THAT(folder.error({negative}),
               Catch::EndsWith("grid \"density\" is -1 at voxel 1 2 3; a density must be at least 0"));
    CHECK_THAT(folder.error({empty}), Catch::EndsWith("has no density above 0, so it can't emit points"));
    CHECK_THAT(error_of([&] { read_density_grid(folder / "none.vdb", ""); }), Catch::Contains("there is no file"));
}

TEST_CASE("small densities below 0 are taken as 0 with a note, and larger ones are refused", "[density_grid]")
{
    const DensityFolder folder;
    const auto grid = fog();
    grid->tree().setValue({0, 0, 0}, 2.0f);
    grid->tree().setValue({1, 0, 0}, -1e-7f);
    grid->tree().setValue({2, 0, 0}, -1e-3f);
    const SkippedContents notes;
    const DensityGridPtr read = folder.read({grid});
    CHECK(notes.list() == std::vector<std::string>{
                              "2 densities of grid \"density\" are below 0, the lowest -0.001; they are taken as 0"});
    CHECK(read->total() == 2);
    const Vec3d P(2, 0, 0);
    double density;
    read->sample({&P, 1}, {&density, 1});
    CHECK(density == 0);

    grid->tree().setValue({3, 0, 0}, -0.01f);
    CHECK_THAT(folder.error({grid}), Catch::Contains("is -0.01 at voxel 3 0 0; a density must be at least 0"));
    grid->tree().setValue({3, 0, 0}, std::nanf(""));
    CHECK_THAT(folder.error({grid}), Catch::Contains("has a value that is not finite, at voxel 3 0 0"));
}

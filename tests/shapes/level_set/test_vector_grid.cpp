#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/vector_grid.h"

#include <openvdb/io/File.h>

#include <filesystem>

#include "runtime/base/error.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Contains;

namespace {

struct VectorFolder : test::TemporaryFolder {
    VectorFolder() { openvdb::initialize(); }

    std::filesystem::path write_grids(const openvdb::GridPtrVec& grids) const
    {
        openvdb::io::File((*this / "grids.vdb").string()).write(grids);
        return *this / "grids.vdb";
    }
};

Vec3d sample(const VectorGrid& grid, const Vec3d& P)
{
    Vec3d value;
    grid.sample({&P, 1}, {&value, 1});
    return value;
}

// Returns a field linear in the position, which trilinear interpolation reproduces exactly.
Vec3d linear(const Vec3d& P) { return {1 + 2 * P.x(), -3 * P.y() + P.z(), 0.5 * P.x() * 1.0}; }

openvdb::Vec3SGrid::Ptr linear_grid(const char* name, const openvdb::math::Transform::Ptr& transform, bool staggered)
{
    auto grid = openvdb::Vec3SGrid::create();
    grid->setName(name);
    grid->setTransform(transform);
    grid->setGridClass(staggered ? openvdb::GRID_STAGGERED : openvdb::GRID_UNKNOWN);
    auto accessor = grid->getAccessor();
    for (int i = -8; i <= 8; ++i)
        for (int j = -8; j <= 8; ++j)
            for (int k = -8; k <= 8; ++k) {
                openvdb::Vec3s value;
                for (int axis = 0; axis < 3; ++axis) {
                    openvdb::Vec3d at(i, j, k);
                    if (staggered) at[axis] -= 0.5;
                    const openvdb::Vec3d P = transform->indexToWorld(at);
                    value[axis] = static_cast<float>(linear({P.x(), P.y(), P.z()})[axis]);
                }
                accessor.setValue({i, j, k}, value);
            }
    return grid;
}

}  // namespace

TEST_CASE("a field that is linear is read exactly between voxels, staggered or not, under any affine map",
          "[vector_grid]")
{
    const VectorFolder folder;
    const bool staggered = GENERATE(false, true);
    const bool turned = GENERATE(false, true);
    CAPTURE(staggered, turned);
    auto transform = openvdb::math::Transform::createLinearTransform(0.25);
    if (turned) transform->preRotate(0.3, openvdb::math::Z_AXIS);
    transform->postTranslate({0.1, -0.2, 0.3});
    const VectorGridPtr grid = read_vector_grid(folder.write_grids({linear_grid("v", transform, staggered)}), "");

    for (const Vec3d& P : {Vec3d(0.1, -0.2, 0.3), Vec3d(0.33, 0.1, 0.777), Vec3d(-0.5, 0.4, -0.21)})
        CHECK((sample(*grid, P) - linear(P)).norm() < 2e-6);
}

TEST_CASE("where a grid has no values it is its background, however far", "[vector_grid]")
{
    const VectorFolder folder;
    auto grid = openvdb::Vec3SGrid::create({1, 2, 3});
    grid->setName("v");
    const VectorGridPtr read = read_vector_grid(folder.write_grids({grid}), "v");
    CHECK(sample(*read, {5, 5, 5}) == Vec3d(1, 2, 3));
    CHECK(sample(*read, {1e30, -1e300, 0}) == Vec3d(1, 2, 3));
}

TEST_CASE("a lattice has the values of its nodes, and its background is zero", "[vector_grid]")
{
    const std::vector<Vec3f> values = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
    const VectorGridPtr grid = make_vector_grid({1, 1, 1}, 0.5, {1, 2, 2}, values);
    CHECK(sample(*grid, {1, 1, 1}).x() == Approx(1));
    CHECK(sample(*grid, {1, 1, 1.5}).x() == Approx(2));
    CHECK(sample(*grid, {1, 1.5, 1}).x() == Approx(3));
    CHECK(sample(*grid, {1, 1.25, 1.25}).x() == Approx(2.5));
    CHECK(sample(*grid, {1, 4, 1}).isZero(0));
}

TEST_CASE("a file without the requested grid is refused with the grids that it has", "[vector_grid]")
{
    const VectorFolder folder;
    auto density = openvdb::FloatGrid::create();
    density->setName("density");
    auto vel = openvdb::Vec3SGrid::create(), rest = openvdb::Vec3SGrid::create();
    vel->setName("vel");
    rest->setName("rest");
    const auto path = folder.write_grids({density, vel, rest});
    const auto refused = [&](const char* name) { return test::error_of([&] { read_vector_grid(path, name); }); };
    CHECK_THAT(refused(""), Contains("there are 2 grids of vectors") && Contains("choose one with grid"));
    CHECK_THAT(refused("vle"), Contains("there is no grid \"vle\"") && Contains("did you mean \"vel\"?"));
    CHECK_THAT(refused("density"), Contains("is float; it must have vectors (vec3s)"));
    const auto only = folder.write_grids({density});
    CHECK_THAT(test::error_of([&] { read_vector_grid(only, ""); }),
               Contains("there is no grid of vectors (vec3s) in") && Contains("\"density\" (float)"));
    CHECK_THAT(test::error_of([&] { read_vector_grid(folder / "none.vdb", ""); }), Contains("there is no file"));
}

TEST_CASE("three grids of floats that are the components of a vector are read as one grid", "[vector grid]")
{
    const VectorFolder folder;
    const auto transform = openvdb::math::Transform::createLinearTransform(0.25);
    const auto vectors = linear_grid("vel", transform, false);
    openvdb::GridPtrVec components;
    for (int axis = 0; axis < 3; ++axis) {
        auto grid = openvdb::FloatGrid::create();
        grid->setName(std::string("vel.") + "xyz"[axis]);
        grid->setTransform(transform->copy());
        for (auto value = vectors->cbeginValueOn(); value; ++value)
            grid->tree().setValue(value.getCoord(), (*value)[axis]);
        components.push_back(grid);
    }
    const auto path = folder.write_grids(components);
    const Vec3d P(0.3, -0.7, 1.1);
    for (const char* name : {"", "vel"}) CHECK((sample(*read_vector_grid(path, name), P) - linear(P)).norm() < 1e-5);

    components[1]->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    folder.write_grids(components);
    CHECK_THAT(test::error_of([&] { read_vector_grid(path, ""); }), Contains("have different maps"));
}

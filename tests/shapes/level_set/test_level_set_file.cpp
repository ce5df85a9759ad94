#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "runtime/base/error.h"
#include "runtime/base/openvdb_grids.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/files/other_circumstances.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Equals;

namespace {

// Messages are compared without the folder's name.
struct LevelSetFolder : test::TemporaryFolder {
    template <class F>
    std::string message_of(const F& f) const
    {
        std::string message = "nothing was thrown";
        try {
            f();
        } catch (const Error& e) {
            message = e.what();
        }
        const std::string in = path().string() + "/";
        for (auto at = message.find(in); at != std::string::npos; at = message.find(in)) message.erase(at, in.size());
        return message;
    }

    void write_grids(const char* name, const openvdb::GridPtrVec& grids) const
    {
        openvdb::io::File((*this / name).string()).write(grids);
    }
};

openvdb::FloatGrid::Ptr sphere_grid(const char* name)
{
    openvdb::initialize();
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.1f, 3);
    grid->setName(name);
    return grid;
}

std::vector<double> distances(const Shape& shape)
{
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> place(-1.5, 1.5);
    std::vector<Vec3d> points(5000);
    for (Vec3d& P : points) P = Vec3d(place(random), place(random), place(random));
    std::vector<double> phi(points.size());
    shape.distance(points, phi, {});
    return phi;
}

}  // namespace

TEST_CASE("a level set read back from its file is bit-identical", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto torus = level_set_torus(0.8, 0.3, {0.1, 0.2, 0.3}, {0.05, 3});
    const auto path = folder / "made/on/the/way/torus.vdb";
    torus->write(path, "ring");
    for (const char* grid : {"ring", ""}) {
        const auto back = read_level_set(path, grid);
        CHECK(back->voxel() == torus->voxel());
        CHECK(back->band() == torus->band());
        CHECK(back->active_voxels() == torus->active_voxels());
        CHECK(distances(*back) == distances(*torus));
    }
    CHECK(std::distance(std::filesystem::directory_iterator(path.parent_path()), {}) == 1);  // no unfinished file
}

TEST_CASE("a file's other grids are left alone, and a grid is found by its name", "[level set][file]")
{
    const LevelSetFolder folder;
    auto fog = openvdb::FloatGrid::create(0);
    fog->setName("density");
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog->tree().setValue({0, 0, 0}, 1.0f);
    folder.write_grids("both.vdb", {fog, sphere_grid("surface")});
    const auto file = folder / "both.vdb";

    CHECK(read_level_set(file, "")->voxel() == Approx(0.1));
    CHECK(read_level_set(file, "surface")->active_voxels() == sphere_grid("surface")->activeVoxelCount());
    CHECK_THAT(
        folder.message_of([&] { read_level_set(file, "surfaces"); }),
        Equals("there is no grid \"surfaces\" in \"both.vdb\"; it has \"density\" (float), \"surface\" (level set of "
               "float); did you mean \"surface\"?"));
    CHECK_THAT(
        folder.message_of([&] { read_level_set(file, "density"); }),
        Equals(
            "grid \"density\" of \"both.vdb\" is float with the class \"fog volume\"; it must be a float level set"));
}

TEST_CASE("level sets that share their values, and files without offsets, are read", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto first = sphere_grid("first"), other = sphere_grid("other");
    const auto second = first->copy();  // shares the tree
    second->setName("second");
    folder.write_grids("shared.vdb", {first, second, other});
    std::ofstream stream(folder / "stream.vdb", std::ios::binary);
    openvdb::io::Stream(stream).write(openvdb::GridCPtrVec{first, second, other});
    stream.close();
    for (const char* file : {"shared.vdb", "stream.vdb"}) {
        const auto expected = distances(*read_level_set(folder / file, "other"));
        CHECK(distances(*read_level_set(folder / file, "first")) == expected);
        CHECK(distances(*read_level_set(folder / file, "second")) == expected);
    }
}

TEST_CASE("files without a level set are refused by name", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto refusal = [&](const char* name, const char* grid) {
        return folder.message_of([&] { read_level_set(folder / name, grid); });
    };
    CHECK_THAT(refusal("none.vdb", ""), Equals("there is no file \"none.vdb\""));

    std::ofstream(folder / "text.vdb") << "this is no grid, and long enough to hold a header that is not there";
    CHECK_THAT(refusal("text.vdb", ""), Catch::Matchers::StartsWith("cannot read \"text.vdb\": ") &&
                                            Catch::Matchers::EndsWith("; it must be an OpenVDB file"));

    folder.write_grids("two.vdb", {sphere_grid("a"), sphere_grid("b")});
    CHECK_THAT(refusal("two.vdb", ""),
               Equals("there are 2 level sets in \"two.vdb\": \"a\" (level set of float), \"b\" "
                      "(level set of float); choose one with grid"));

    auto empty = openvdb::FloatGrid::create(0.3f);
    empty->setName("empty");
    empty->setGridClass(openvdb::GRID_LEVEL_SET);
    folder.write_grids("empty.vdb", {empty});
    CHECK_THAT(refusal("empty.vdb", ""),
               Equals("grid \"empty\" of \"empty.vdb\" is empty; a level set needs a surface"));

    auto positive = empty->deepCopy();
    positive->tree().setValue({0, 0, 0}, 0.1f);
    folder.write_grids("positive.vdb", {positive});
    CHECK_THAT(
        refusal("positive.vdb", ""),
        Equals(
            "grid \"empty\" of \"positive.vdb\" has 1 active voxels but no surface; a level set must change its sign"));

    folder.write_grids("fog.vdb", {[] {
                           auto fog = openvdb::FloatGrid::create(0);
                           fog->setName("density");
                           return fog;
                       }()});
    CHECK_THAT(refusal("fog.vdb", ""),
               Equals("there is no level set in \"fog.vdb\"; its grids are \"density\" (float)"));
}

TEST_CASE("a level set whose map turns, mirrors or stretches is resampled to cubes, with a note", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto map = GENERATE(0, 1, 2);
    CAPTURE(map);
    auto grid = sphere_grid("surface");
    if (map == 0) grid->transform().postRotate(0.5, openvdb::math::Y_AXIS);
    if (map == 1)
        grid->setTransform(openvdb::math::Transform::createLinearTransform(
            openvdb::Mat4R(-0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 1.0)));
    if (map == 2)
        grid->setTransform(openvdb::math::Transform::createLinearTransform(
            openvdb::Mat4R(0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 3.0, 0.0, 0.0, 1.0)));
    folder.write_grids("map.vdb", {grid});
    const SkippedContents notes;
    const auto read = read_level_set(folder / "map.vdb", "");
    CHECK(notes.list() == std::vector<std::string>{"the voxels of grid \"surface\" are not cubes along the axes; it is "
                                                   "resampled to cubes of 0.1 m"});
    CHECK(read->voxel() == Approx(0.1));
    const Vec3d center(map == 2 ? 3 : 0, 0, 0);
    for (const double outside : {-0.15, 0.15})
        for (const Vec3d& direction : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, -1)}) {
            const double radius = map == 2 && direction.y() != 0 ? 2 : 1;
            const Vec3d P = center + (radius + outside) * direction;
            double phi;
            read->distance({&P, 1}, {&phi, 1}, {});
            CHECK(phi == Approx(outside).margin(0.02));  // voxel² / radius of curvature, at least 0.5
        }
}

TEST_CASE("distances in voxels become metres, and values that are not distances are noted", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto scaled = [&](float factor) {
        auto grid = sphere_grid("surface");
        for (auto value = grid->beginValueAll(); value; ++value) value.setValue(factor * *value);
        openvdb::tools::changeBackground(grid->tree(), factor * grid->background());
        folder.write_grids("scaled.vdb", {grid});
        return read_level_set(folder / "scaled.vdb", "");
    };
    const auto plain = distances(*scaled(1));
    const SkippedContents notes;
    const auto in_metres = distances(*scaled(10));
    CHECK(notes.list() ==
          std::vector<std::string>{"the distances of grid \"surface\" are in voxels; they are multiplied by 0.1 m"});
    for (std::size_t i = 0; i < plain.size(); ++i) REQUIRE(in_metres[i] == Approx(plain[i]).margin(1e-6));

    const SkippedContents others;
    scaled(4);
    REQUIRE(others.list().size() == 1);
    CHECK_THAT(others.list()[0], Catch::StartsWith("the values of grid \"surface\" change by ") &&
                                     Catch::EndsWith("rebuild the level set"));
}

TEST_CASE("distances in voxels of about a metre are told from distances in metres", "[level set][file]")
{
    const float voxel = GENERATE(0.6f, 1.0f, 1.5f);
    const bool in_voxels = GENERATE(false, true);
    CAPTURE(voxel, in_voxels);
    const LevelSetFolder folder;
    openvdb::initialize();
    const auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(10 * voxel, openvdb::Vec3f(0), voxel, 3);
    const float unit = in_voxels ? voxel : 1;
    for (auto value = grid->beginValueAll(); value; ++value) value.setValue(*value / unit);
    openvdb::tools::changeBackground(grid->tree(), grid->background() / unit);
    folder.write_grids("sphere.vdb", {grid});
    const SkippedContents notes;
    const auto read = read_level_set(folder / "sphere.vdb", "");
    CHECK(notes.list().size() == (in_voxels && voxel != 1 ? 1 : 0));
    for (const double outside : {-1.0, 0.5, 2.0}) {
        const Vec3d P((10 + outside) * voxel, 0, 0);
        double phi;
        read->distance({&P, 1}, {&phi, 1}, {});
        CHECK(phi == Approx(outside * voxel).margin(0.05 * voxel));
    }
}

TEST_CASE("a level set from a file is widened without moving its surface", "[level set][file]")
{
    const LevelSetFolder folder;
    folder.write_grids("sphere.vdb", {sphere_grid("surface")});
    const auto narrow = read_level_set(folder / "sphere.vdb", "");
    const auto wide = narrow->with_band(0.8);
    CHECK(wide->band() >= 0.8);
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> place(-1.9, 1.9);
    for (int n = 0; n < 10'000; ++n) {
        const Vec3d P(place(random), place(random), place(random));
        const double exact = P.norm() - 1;
        double a, b;
        narrow->distance({&P, 1}, {&a, 1}, {});
        wide->distance({&P, 1}, {&b, 1}, {});
        if (std::abs(exact) < 0.1) REQUIRE(a == b);
        if (std::abs(exact) < 0.6)
            REQUIRE(b == Approx(exact).margin(0.01));  // voxel² / (radius of curvature, at least 0.4) / 4
    }
}

TEST_CASE("a level set that a full disk has no room for is an error, and nothing of it stays", "[level set][file]")
{
    const test::SmallDisk disk;
    if (!disk.mounted()) return;  // mounting is not permitted, so there is no disk to fill
    const auto sphere = level_set_sphere(1, Vec3d::Zero(), {0.02, 6});
    const std::string error = test::error_of([&] { sphere->write(disk.folder() / "sphere.vdb", "surface"); });
    CHECK_THAT(error, Catch::Matchers::StartsWith("cannot write \"") &&
                          Catch::Matchers::EndsWith("sphere.vdb\": can't be written: No space left on device"));
    CHECK(test::file_names(disk.folder().path()).empty());
}

TEST_CASE("a level set that can't be written reports the path and leaves no file", "[level set][file]")
{
    const LevelSetFolder folder;
    const auto sphere = level_set_sphere(1, Vec3d::Zero(), {0.2, 3});
    std::ofstream(folder / "file") << "in the way";
    const auto below_a_file = folder / "file/sphere.vdb";
    CHECK_THAT(folder.message_of([&] { sphere->write(below_a_file, "surface"); }),
               Catch::Matchers::StartsWith("cannot write \"file/sphere.vdb\": "));
    CHECK_THAT(folder.message_of([&] { sphere->write(folder / "sphere.vdb", ""); }),
               Equals("cannot write \"sphere.vdb\": the grid needs a name"));
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

#include <fmt/format.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include "runtime/base/openvdb_grids.h"
#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

openvdb::points::PointDataGrid::Ptr read_grid(const std::filesystem::path& path, const std::string& name)
{
    openvdb::initialize();
    openvdb::io::File file(path.string());
    file.open();
    return openvdb::gridPtrCast<openvdb::points::PointDataGrid>(file.readGrid(name));
}

}  // namespace

TEST_CASE("points come back from .vdb with the same bits, whatever the scale of the scene", "[io][vdb]")
{
    const std::size_t size = GENERATE(1, 2, 5000);
    const float extent = GENERATE(1e-3f, 2.0f, 1e5f, 1e20f);
    CAPTURE(size, extent);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = extent, .first_id = std::int64_t{1} << 40});

    write_points(folder / "a.vdb", points);

    CHECK(differing_columns(points, read_points(folder / "a.vdb")) == "");
}

TEST_CASE("a .vdb keeps negative zeros, NaN attributes and a few metres beside a kilometre", "[io][vdb]")
{
    const TemporaryFolder folder;
    PointSet points = random_points({.size = 100});
    points.P().write()[0] = Vec3f(-0.0f, 0.0f, -0.0f);
    points.P().write()[1] = Vec3f(1e3f, -1e-3f, std::nextafter(1e3f, 0.0f));
    points.P().write()[2] = Vec3f(1e-30f, -1e-36f, 0.5f);
    points.column<float>("age").write()[3] = std::numeric_limits<float>::quiet_NaN();
    points.column<float>("age").write()[4] = -std::numeric_limits<float>::infinity();
    for (float& age : points.column<float>("age").write().subspan(5)) age = -0.0f;

    write_points(folder / "a.vdb", points);

    CHECK(differing_columns(points, read_points(folder / "a.vdb")) == "");
}

TEST_CASE("points at one position, and empty sets, are written to .vdb and read", "[io][vdb][extreme]")
{
    const TemporaryFolder folder;
    PointSet heap = random_points({.size = 3000});
    heap.P().fill(Vec3f(1, 2, 3));
    write_points(folder / "heap.vdb", heap);
    CHECK(differing_columns(heap, read_points(folder / "heap.vdb")) == "");

    heap.P().fill(Vec3f::Zero());
    write_points(folder / "origin.vdb", heap);
    CHECK(differing_columns(heap, read_points(folder / "origin.vdb")) == "");

    write_points(folder / "none.vdb", PointSet());
    CHECK(differing_columns(PointSet(), read_points(folder / "none.vdb")) == "");
}

TEST_CASE("a .vdb without points keeps its attributes and groups, for OpenVDB too", "[io][vdb][extreme]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 0});
    REQUIRE(points.has("orient"));
    write_points(folder / "none.vdb", points);
    CHECK(differing_columns(points, read_points(folder / "none.vdb")) == "");

    const auto grid = read_grid(folder / "none.vdb", "points");
    CHECK(openvdb::points::pointCount(grid->tree()) == 0);
    CHECK(grid->activeVoxelCount() == 0);
    const auto& descriptor = grid->tree().cbeginLeaf()->attributeSet().descriptor();
    CHECK(descriptor.valueType(descriptor.find("orient")) == "quats");
    CHECK(descriptor.groupMap().count("hot") == 1);
}

TEST_CASE("OpenVDB itself finds the attributes, groups and positions that were written", "[io][vdb]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 4000});
    write_points(folder / "a.vdb", points, {.number = 7, .time = 0.25});

    const auto grid = read_grid(folder / "a.vdb", "points");

    CHECK(openvdb::points::pointCount(grid->tree()) == 4000);
    CHECK(grid->metaValue<std::int32_t>("frame") == 7);
    const auto& descriptor = grid->tree().cbeginLeaf()->attributeSet().descriptor();
    const auto type = [&](const char* name) { return descriptor.valueType(descriptor.find(name)); };
    CHECK(type("P") == "vec3s");
    CHECK(type("v") == "vec3s");
    CHECK(type("id") == "int64");
    CHECK(type("age") == "float");
    CHECK(type("hitnum") == "int32");
    CHECK(type("orient") == "quats");
    CHECK(descriptor.groupMap().count("hot") == 1);

    // Every point by OpenVDB's own arithmetic, found by its id.
    std::map<std::int64_t, std::size_t> place;
    for (std::size_t i = 0; i < points.size(); ++i) place[points.id()[i]] = i;
    std::size_t found = 0;
    double largest = 0;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::points::AttributeHandle<openvdb::Vec3f> P(leaf->constAttributeArray("P"));
        const openvdb::points::AttributeHandle<std::int64_t> id(leaf->constAttributeArray("id"));
        const openvdb::points::AttributeHandle<float> pscale(leaf->constAttributeArray("pscale"));
        CHECK(pscale.isUniform());
        for (auto index = leaf->beginIndexOn(); index; ++index) {
            const openvdb::Vec3d world = grid->indexToWorld(P.get(*index) + index.getCoord().asVec3d());
            const Vec3f& expected = points.P()[place.at(id.get(*index))];
            largest = std::max(largest, (Vec3d(world.x(), world.y(), world.z()) - expected.cast<double>()).norm());
            ++found;
        }
    }
    CHECK(found == 4000);
    CHECK(largest == 0);
}

TEST_CASE("leaves hold a workable number of points for a line, a sheet and a cloud", "[io][vdb]")
{
    const int dimensions = GENERATE(1, 2, 3);
    CAPTURE(dimensions);
    const TemporaryFolder folder;
    PointSet points = random_points({.size = 200000, .extent = 10, .wide = false});
    for (Vec3f& P : points.P().write())
        for (int axis = dimensions; axis < 3; ++axis) P[axis] = 0.3f;
    // A stray far away must not make all voxels large.
    points.P().write()[0] = Vec3f(5000, 0, 0);
    write_points(folder / "a.vdb", points);

    const auto grid = read_grid(folder / "a.vdb", "points");
    const double mean = 200000.0 / static_cast<double>(grid->tree().leafCount());
    CAPTURE(mean);
    // The target is 2,048. A voxel size rounded to a power of two changes a cloud's count by up to 8^(1/2) either way.
    CHECK(mean > 256);
    CHECK(mean < 16384);
}

TEST_CASE("a .vdb with several grids, codecs and types of other programs is read as a whole", "[io][vdb]")
{
    using namespace openvdb;
    openvdb::initialize();
    const TemporaryFolder folder;
    const std::vector<Vec3R> at = {{1, 2, 3}, {-4, 5, 6}};
    const auto transform = math::Transform::createLinearTransform(0.1);
    const auto first =
        points::createPointDataGrid<points::FixedPointCodec<false>, points::PointDataGrid>(at, *transform);
    points::appendAttribute<double>(first->tree(), "heat", 2.5);
    points::appendAttribute<std::int16_t>(first->tree(), "kind", std::int16_t(-3));
    points::appendAttribute<float, points::TruncateCodec>(first->tree(), "half", 0.5f);
    points::appendAttribute<float>(first->tree(), "uv", 0.75f, 2);
    points::appendAttribute(first->tree(), "label", points::StringAttributeArray::attributeType());
    first->setName("first");
    const std::vector<Vec3R> more = {{10, 0, 0}};
    const auto second = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(more, *transform);
    second->setName("second");
    const auto sphere = tools::createLevelSetSphere<FloatGrid>(1, {0, 0, 0}, 0.2f);
    sphere->setName("surface");
    io::File((folder / "a.vdb").string()).write(GridCPtrVec{first, second, sphere});

    const PointSet read = read_points(folder / "a.vdb");

    REQUIRE(read.size() == 3);
    CHECK(read.id()[2] == 2);
    rapid::Vec3f low = read.P()[0].cwiseMin(read.P()[1]), high = read.P()[0].cwiseMax(read.P()[1]);
    // 16-bit fixed point in voxels of 0.1 m.
    CHECK_THAT(low, close_to(rapid::Vec3f(-4, 2, 3), 0.1 / 65535));
    CHECK_THAT(high, close_to(rapid::Vec3f(1, 5, 6), 0.1 / 65535));
    CHECK_THAT(read.P()[2], close_to(rapid::Vec3f(10, 0, 0), 1e-6));
    CHECK(read.column<float>("heat")[0] == 2.5f);
    CHECK(read.column<float>("heat")[2] == 0.0f);
    CHECK(read.column<std::int32_t>("kind")[1] == -3);
    CHECK(read.column<float>("half")[0] == 0.5f);
    CHECK(read.column<float>("uv1")[0] == 0.75f);
    CHECK(read.column<Token>("label")[0] == Token());
}

TEST_CASE("a .vdb without points says which grids it has", "[io][vdb]")
{
    openvdb::initialize();
    const TemporaryFolder folder;
    const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.2f);
    sphere->setName("surface");
    openvdb::io::File((folder / "a.vdb").string()).write(openvdb::GridCPtrVec{sphere});

    CHECK(error_of([&] { read_points(folder / "a.vdb"); }) ==
          (folder / "a.vdb").string() + ": the file contains no points; its grids are \"surface\" (Tree_float_5_4_3)");
}

TEST_CASE("a .vdb that is cut is an error that says so", "[io][vdb]")
{
    const TemporaryFolder folder;
    write_points(folder / "whole.vdb", random_points({.size = 100}));
    const std::string whole = file_text(folder / "whole.vdb");
    for (const std::size_t missing : {1, 50, 100}) {
        const auto path = folder.write("cut.vdb", whole.substr(0, whole.size() - missing));
        CHECK(error_of([&] { read_points(path); }) ==
              fmt::format(
                  "{}: can't be read: it is cut off: its grid \"points\" ends at byte {}, but the file at byte {}",
                  path.string(), whole.size(), whole.size() - missing));
    }
    const auto header = folder.write("header.vdb", whole.substr(0, 40));
    CHECK(error_of([&] { read_points(header); }) == header.string() + ": can't be read: it is cut off or damaged");
    // Bytes after the last grid are ignored.
    CHECK(read_points(folder.write("longer.vdb", whole + "more")).size() == 100);
}

TEST_CASE("a .vdb whose sizes contradict each other is refused before OpenVDB reads beyond its arrays", "[io][vdb]")
{
    constexpr std::uint32_t size = 100;
    const TemporaryFolder folder;
    PointSet points;
    points.append(size);
    points.add({"pscale", 0.02f});
    write_points(folder / "whole.vdb", points);
    const std::string whole = file_text(folder / "whole.vdb");
    // The array of one float for all points: its bytes and 6, its flags, how it is stored (paged, uniform), its points.
    std::string array("\x0a\0\0\0\0\0\0\0\x08\x0a", 10);
    array.append(reinterpret_cast<const char*>(&size), sizeof size);
    const std::size_t at = whole.find(array);
    REQUIRE(at != std::string::npos);
    const auto error = [&](std::size_t offset, char value) {
        std::string text = whole;
        text[at + offset] = value;
        const auto path = folder.write("damaged.vdb", text);
        std::string message = error_of([&] { read_points(path); });
        return message.erase(0, std::min(message.size(), path.string().size() + 2));
    };
    const std::string damaged = "can't be read: it is cut off or damaged";
    CHECK(error(0, 8) == damaged);  // two bytes
    CHECK(error(9, 8) == damaged);  // not uniform: a float for each point
    CHECK(error(10, 99) == "can't be read: a leaf of the grid \"points\" has more points than values");
}

TEST_CASE("a position that is not finite can't be written to .vdb, and the error names the point", "[io][vdb]")
{
    const TemporaryFolder folder;
    PointSet points = random_points({.size = 10, .first_id = 100});
    points.P().write()[0].y() = std::numeric_limits<float>::quiet_NaN();

    const std::string error = error_of([&] { write_points(folder / "a.vdb", points); });

    CHECK_THAT(error, Catch::Contains("a.vdb: point 100: P = ") && Catch::Contains("nan"));
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("the bytes of a .vdb do not depend on the number of threads", "[io][vdb][threads]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 60000});
    std::string first;
    for (const int threads : {1, 2, 7}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        write_points(folder / "a.vdb", points);
        const std::string bytes = file_text(folder / "a.vdb");
        if (first.empty()) first = bytes;
        CHECK((bytes == first));
    }
}

// Point files written in pieces are identical to files written at once.
#include "runtime/io/point_file.h"

#include <numeric>

#include "runtime/base/memory_budget.h"
#include "tests/files/temporary_folder.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

namespace rapid {
namespace {

using namespace test;

// Without groups, and in order of id, because .csv then writes its data at once.
PointSet some_points(std::size_t size)
{
    PointSet points = random_points({.size = size, .wide = false});
    for (const std::string& name : points.group_names()) points.remove_group(name);
    const std::span<std::int64_t> ids = points.id().write();
    std::iota(ids.begin(), ids.end(), std::int64_t{0});
    return points;
}

PointSet slice_of(const PointSet& points, std::size_t begin, std::size_t end)
{
    std::vector<std::uint32_t> indices(end - begin);
    std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(begin));
    return points.select(indices);
}

void write_in_pieces(const std::filesystem::path& path, const PointSet& points, const std::vector<std::size_t>& ends)
{
    PointFile file(path, slice_of(points, 0, 0));
    std::size_t begin = 0;
    for (const std::size_t end : ends) file.append(slice_of(points, std::exchange(begin, end), end));
    CHECK_FALSE(std::filesystem::exists(path));
    file.finish();
}

}  // namespace

TEST_CASE("a file of points in pieces is, byte for byte, that of all of them", "[io][pieces]")
{
    const TemporaryFolder folder;
    for (const Format& format : formats())
        for (const std::size_t size : {0, 1, 10000}) {
            if (!format.read) continue;
            const PointSet points = some_points(size);
            const std::string name = std::to_string(size) + format.extension;
            CAPTURE(name);
            write_points(folder / ("whole" + name), points);
            write_in_pieces(folder / ("pieces" + name), points, {0, size / 3, size / 3, size / 2, size});
            CHECK((file_text(folder / ("pieces" + name)) == file_text(folder / ("whole" + name))));
        }
}

TEST_CASE("pieces stay in the order in which they come", "[io][pieces]")
{
    const TemporaryFolder folder;
    const PointSet points = some_points(6);
    for (const std::string name : {"a.csv", "a.bgeo"}) {
        PointFile file(folder / name, slice_of(points, 0, 0));
        file.append(slice_of(points, 3, 6));
        file.append(slice_of(points, 0, 3));
        file.finish();
        const PointSet read = read_points(folder / name);
        CHECK(std::vector<std::int64_t>(read.id().read().data, read.id().read().data + 6) ==
              std::vector<std::int64_t>{3, 4, 5, 0, 1, 2});
    }
}

TEST_CASE("of a file of points that is not finished nothing stays", "[io][pieces]")
{
    const TemporaryFolder folder;
    {
        PointFile file(folder / "a.csv", PointSet());
        file.append(some_points(0));
    }
    CHECK(file_names(folder.path()).empty());
    CHECK_THROWS_WITH(PointFile(folder / "a.xyz", PointSet()), Catch::Contains("a.xyz: unknown extension"));
}

TEST_CASE("data kept until the end is refused beyond --memory, data written at once is not", "[io][pieces]")
{
    const TemporaryFolder folder;
    const std::uint64_t before = memory_budget();
    set_memory_budget(1);
    PointSet points;
    points.append(1000000);
    for (Vec3f& P : points.P().write()) P.setOnes();
    for (Vec3f& v : points.v().write()) v.setOnes();
    std::iota(points.id().write().begin(), points.id().write().end(), std::int64_t{0});
    PointFile kept(folder / "a.npz", PointSet()), streamed(folder / "a.bgeo", PointSet());
    const auto fill = [&](PointFile& file) {
        for (int i = 0; i < 5; ++i) file.append(points);
    };
    CHECK_THROWS_WITH(fill(kept),
                      Catch::Contains("a.npz: 3000000 points, which .npz must hold in memory, would need") &&
                          Catch::Contains("write .csv or .bgeo, which are written point by point"));
    CHECK_NOTHROW(fill(streamed));
    set_memory_budget(before);
}

}  // namespace rapid

#include "runtime/points/column_files.h"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "runtime/points/column.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

constexpr std::size_t large = 32 << 20;  // values

// Returns the resident memory in kB.
long resident_memory()
{
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmRSS:")) return std::stol(line.substr(6));
    return 0;
}

TEST_CASE("columns in files have their values, and little of them is in memory", "[column_files]")
{
    const test::TemporaryFolder folder;
    const long before = resident_memory();
    {
        const ColumnFiles files(folder.path(), 16 << 20);
        Column<std::int64_t> column;
        long most = 0;
        for (std::size_t part = 0; part < 16; ++part) {  // growing moves the values
            const std::span<std::int64_t> added = column.append_for_writing(large / 16);
            std::iota(added.begin(), added.end(), static_cast<std::int64_t>(part * large / 16));
            most = std::max(most, resident_memory());
        }
        const Column<std::int64_t> same = column;
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < large; ++i) wrong += same[i] != static_cast<std::int64_t>(i);
        CHECK(wrong == 0);
        CHECK(column.bytes() == 256 << 20);
        CHECK(most - before < 128 << 10);
        CHECK(std::filesystem::is_empty(folder.path()));
    }
    CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("columns made before and after are in memory as ever", "[column_files]")
{
    const test::TemporaryFolder folder;
    Column<float> before(1 << 20, 1.0f);
    before.write()[0] = 2;
    {
        const ColumnFiles files(folder.path(), 1 << 20);
        before.append_for_writing(1 << 20)[0] = 3;
        CHECK(before[1 << 20] == 3);
    }
    CHECK(before[0] == 2);
    CHECK(before[1] == 1);
}

// Counts the blocks mapped from unnamed files in this folder.
std::size_t blocks_in(const std::filesystem::path& folder)
{
    std::size_t count = 0;
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) count += line.find(folder.string() + '/') != std::string::npos;
    return count;
}

TEST_CASE("a pause keeps columns in memory, and points are moved into files with their values", "[column_files]")
{
    const test::TemporaryFolder folder;
    const ColumnFiles files(folder.path(), 1 << 20);
    PointSet points;
    {
        const ColumnFiles::Pause pause;
        points.append(1 << 18);
        std::span<std::int64_t> ids = points.id().write();
        std::iota(ids.begin(), ids.end(), std::int64_t{5});
        points.group("late").write()[7] = 1;
    }
    CHECK(blocks_in(folder.path()) == 0);
    points = ColumnFiles::moved(std::move(points));
    CHECK(blocks_in(folder.path()) == 2);
    CHECK(points.P().is_uniform());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        wrong += points.id()[i] != static_cast<std::int64_t>(i + 5) || (*points.find_group("late"))[i] != (i == 7);
    CHECK(wrong == 0);
    points = PointSet();
    CHECK(blocks_in(folder.path()) == 0);
}

TEST_CASE("values that are written are those of the column, in files and in memory, and no others", "[column_files]")
{
    const test::TemporaryFolder folder;
    const std::size_t size = GENERATE(std::size_t{100}, std::size_t{1} << 20);  // from the heap; from pages
    const bool in_files = GENERATE(false, true);
    CAPTURE(size, in_files);
    std::optional<ColumnFiles> files;
    if (in_files) files.emplace(folder.path(), 1 << 20);
    Column<std::int32_t> column, neighbour;
    std::vector<std::int32_t> expected(size);
    std::iota(expected.begin(), expected.end(), 0);
    std::span<std::int32_t> values = column.append_for_writing(size);
    std::copy(expected.begin(), expected.end(), values.begin());
    neighbour.append(std::span<const std::int32_t>(expected));

    const std::vector<std::int32_t> other(size / 3, -7);
    for (const std::size_t at : {std::size_t{0}, size / 2 + 1, size - other.size()}) {
        write_values(&values[at], other.data(), other.size() * sizeof(std::int32_t));
        std::copy(other.begin(), other.end(), expected.begin() + static_cast<std::ptrdiff_t>(at));
        const auto grown = column.append_for_writing(size / 4);  // may move the values
        std::iota(grown.begin(), grown.end(), 3);
        for (std::size_t i = 0; i < size / 4; ++i) expected.push_back(3 + static_cast<std::int32_t>(i));
        values = column.write();
    }
    CHECK(std::equal(values.begin(), values.end(), expected.begin(), expected.end()));
    CHECK(neighbour[size / 2] == static_cast<std::int32_t>(size / 2));
    CHECK(blocks_in(folder.path()) == (in_files && size > 100 ? 2 : 0));
}

TEST_CASE("a folder that takes no files is refused", "[column_files]")
{
    const ColumnFiles files("/proc/self/nowhere", 1 << 20);
    Column<float> column;
    const std::string message = test::error_of([&] { column.append_for_writing(1 << 20); });
    CHECK(message.find("/proc/self/nowhere") != std::string::npos);
}

}  // namespace
}  // namespace rapid

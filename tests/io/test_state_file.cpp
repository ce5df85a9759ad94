// State files: written data is read back, and damaged files are refused before use.
#include "runtime/io/state_file.h"

#include "runtime/points/state_archive.h"
#include "tests/files/temporary_folder.h"
#include "tests/io/random_points.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

PointSet kept_points()
{
    test::Points points({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
    points.set<float>("heat", {1, 2, 3}).set<std::int32_t>("bin", {-1, 0, 7}).group("hot", {0, 2});
    points.PointSet::set("orient", Column<Quatf>(std::vector<Quatf>(3, Quatf(0.5f, 0.5f, 0.5f, 0.5f))));
    points.add({"pscale", 0.25f});
    return points;
}

fs::path written(const test::TemporaryFolder& folder, const SavedState& state)
{
    write_state(folder / "state", {{"rapid", "0.1.0"}, {"frame", 12}}, state);
    return folder / "state";
}

}  // namespace

TEST_CASE("a state that is read from its file is the one that was written", "[state]")
{
    const test::TemporaryFolder folder;
    for (const SavedState& state : {state_of(kept_points()), SavedState(), state_of(PointSet())}) {
        const StateFile file(written(folder, state));
        CHECK(file.state() == state);
        CHECK(file.header().at("frame") == 12);
        CHECK(StateFile::is_one(folder / "state"));
        PointSet points;
        if (!state.bytes.empty()) restore(points, file.state());
    }
}

TEST_CASE("the header of a state's file can be read as text", "[state]")
{
    const test::TemporaryFolder folder;
    const std::string text = test::file_text(written(folder, state_of(kept_points())));
    CHECK(text.substr(0, 8) == "\x89RAPID\r\n");
    CHECK(text.find("\"frame\": 12") != std::string::npos);
    CHECK(text.find("\"type\": \"vec3\"") != std::string::npos);
}

TEST_CASE("equal values are stored in less than they take", "[state]")
{
    const test::TemporaryFolder folder;
    PointSet points;
    points.append(100000);
    for (std::int64_t& id : points.id().write()) id = 5;
    CHECK(fs::file_size(written(folder, state_of(points))) < points.id().bytes() / 16);
}

TEST_CASE("columns of several pieces are kept, those that compress and those that do not", "[state]")
{
    const test::TemporaryFolder folder;
    const std::size_t size = GENERATE(std::size_t{262144}, std::size_t{700001});  // a piece of floats, and a few more
    const PointSet points = test::random_points({.size = size, .seed = 3});
    const SavedState state = state_of(points);
    const fs::path path = written(folder, state);
    CHECK(StateFile(path).state() == state);
    // The first half of a column is noise, but the sample, after it, is not.
    SavedState mixed;
    Column<std::int32_t> half(0);
    const std::span<std::int32_t> values = half.append_for_writing(size);
    for (std::size_t i = 0; i < size; ++i)
        values[i] = i < size / 2 - 20000 ? static_cast<std::int32_t>(i * 2654435761u) : 0;
    mixed.columns.push_back(half);
    CHECK(StateFile(written(folder, mixed)).state() == mixed);
}

TEST_CASE("a file with any bit flipped, or with trailing bytes, is refused", "[state]")
{
    const test::TemporaryFolder folder;
    const std::string text = test::file_text(written(folder, state_of(kept_points())));
    const auto refused = [&](const std::string& other) {
        const fs::path path = folder.write("damaged", other);
        return !test::error_of([&] { StateFile(path).state(); }).empty();
    };
    std::size_t accepted = 0;
    for (std::size_t at = 0; at < text.size(); ++at)
        for (int bit = 0; bit < 8; bit += 3) {
            std::string other = text;
            other[at] = static_cast<char>(other[at] ^ (1 << bit));
            accepted += !refused(other);
        }
    CHECK(accepted == 0);
    CHECK(refused(text + "more"));
    CHECK(!refused(text));
}

TEST_CASE("a file that is not a state is reported as such", "[state]")
{
    const test::TemporaryFolder folder;
    const fs::path path = folder.write("points.csv", "P.x,P.y,P.z\n1,2,3\n");
    CHECK(!StateFile::is_one(path));
    CHECK(test::error_of([&] { StateFile file(path); }) == "it does not begin like one; it is not a complete snapshot");
}

}  // namespace rapid

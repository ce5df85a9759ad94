// Frames that a program holds on to, in memory and in files.
#include <cstring>
#include <filesystem>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

const std::string two_outputs = R"(local rapid = require "rapid"
local function chain(x) return rapid.create { fps = 30, points = rapid.points.from {
  P = {{x, 1, 0}, {x, 2, 0}, {x, 3, 0}}, life = {0.01, 9, 9}, name = {"a", "b", "a"} } }
  :gravity {} :group { name = "high", where = function(p) return p.P.y > 2 end } :solve {} end
return { left = chain(0), right = chain(5) })";

void check_same_bits(const SceneFrame& a, const SceneFrame& b)
{
    REQUIRE(a.outputs() == b.outputs());
    for (const std::string& output : a.outputs()) {
        const SceneFrame of_a = good(a.output(output)), of_b = good(b.output(output));
        CHECK(of_a.time() == of_b.time());
        CHECK(of_a.fps() == of_b.fps());
        REQUIRE(of_a.columns() == of_b.columns());
        CHECK(of_a.groups() == of_b.groups());
        for (const std::string& name : of_a.columns()) {
            CAPTURE(output, name);
            const SceneColumn x = *of_a.column(name), y = *of_b.column(name);
            REQUIRE((x.type == y.type && x.count == y.count && x.stride == y.stride));
            const std::size_t bytes = x.stride > 0 ? x.stride : 4;
            for (std::size_t i = 0; i < x.count; ++i) CHECK(std::memcmp(x.at<char>(i), y.at<char>(i), bytes) == 0);
        }
    }
}

}  // namespace

TEST_CASE("a frame of a file has the bits of the one that was saved", "[kept]")
{
    const test::TemporaryFolder folder;
    Scene scene = test::opened(two_outputs);
    const SceneFrame frame = good(scene.advance_to(3));
    good(SceneInside::save(frame, folder / "deep/frame", "key"));
    const SceneFrame read = good(SceneInside::load_frame(folder / "deep/frame", "key"));
    CHECK(read.number() == 3);
    check_same_bits(frame, read);
    CHECK(read.statistics().seconds == 0);
}

TEST_CASE("a frame of another key, and a file of another kind, are errors that name the file", "[kept]")
{
    const test::TemporaryFolder folder;
    Scene scene = test::opened(two_outputs);
    const SceneFrame frame = good(scene.advance());
    good(SceneInside::save(frame, folder / "frame", "one"));
    const SceneError other = SceneInside::load_frame(folder / "frame", "two").error();
    CHECK(other.kind == SceneError::WrongCall);
    CHECK(other.text() == (folder / "frame").string() + ": it belongs to another run");
    CHECK_FALSE(SceneInside::load_frame(folder / "frame", ""));
    CHECK_FALSE(SceneInside::load_frame(folder / "missing", ""));
    CHECK_FALSE(SceneInside::load_frame(folder.write("text", "no frame"), ""));
    good(good(scene.save()).write(folder / "snapshot"));
    CHECK_THAT(SceneInside::load_frame(folder / "snapshot", "").error().message,
               Contains("it contains the snapshot of a scene"));

    const std::string whole = test::file_text(folder / "frame");
    for (std::size_t at = 8; at < whole.size(); at += 61) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
        CHECK_FALSE(SceneInside::load_frame(folder.write("damaged", damaged), "one"));
    }
    CHECK_FALSE(SceneInside::save(frame, folder / "text/below", ""));
}

TEST_CASE("a snapshot with a key is read by it alone", "[kept]")
{
    const test::TemporaryFolder folder;
    Scene scene = test::opened(two_outputs);
    good(scene.advance_to(2));
    good(SceneInside::save(good(scene.save()), folder / "snapshot", "one"));
    CHECK(good(SceneInside::load_snapshot(folder / "snapshot", "one")).frame() == 2);
    CHECK(good(SceneSnapshot::read(folder / "snapshot")).frame() == 2);
    CHECK_THAT(SceneInside::load_snapshot(folder / "snapshot", "two").error().text(),
               Contains("it belongs to another run"));
}

TEST_CASE("points alone are those of their frame, and have no statistics", "[kept]")
{
    Scene scene = test::opened(two_outputs);
    const SceneFrame frame = good(scene.advance_to(2));
    const SceneFrame points = good(SceneInside::without_statistics(good(frame.output("right"))));
    check_same_bits(frame, points);
    CHECK(points.column("P")->data == good(frame.output("right")).column("P")->data);
    CHECK(frame.statistics().seconds > 0);
    CHECK(points.statistics().seconds == 0);
    CHECK(points.profile_json() == "[]");
    CHECK(SceneInside::bytes(points) == SceneInside::bytes(frame));
}

TEST_CASE("a frame takes at least the bytes of its columns that are written out", "[kept]")
{
    Scene scene = test::opened(two_outputs);
    const SceneFrame frame = good(scene.advance_to(2));
    std::size_t bytes = 0;
    for (const std::string& output : frame.outputs())
        for (const std::string& name : frame.columns())
            bytes += frame.size() * good(frame.output(output)).column(name)->stride;
    CHECK(bytes > 0);
    CHECK(SceneInside::bytes(frame) >= bytes);
    CHECK(SceneInside::bytes(frame) < bytes + 4096);
}

TEST_CASE("points are found by their ids, and dead ones are not", "[kept]")
{
    Scene scene = test::opened(two_outputs);
    const SceneFrame frame = good(scene.advance_to(4));
    REQUIRE(frame.size() == 2);  // the one with id 0 has died
    CHECK(good(frame.indices({2, 0, 1, -1, 77, 2})) ==
          std::vector<std::uint32_t>{1, SceneFrame::no_index, 0, SceneFrame::no_index, SceneFrame::no_index, 1});
    CHECK(good(frame.indices({})).empty());
}

TEST_CASE("a number of spare columns that is no number of columns is refused", "[kept]")
{
    good(SceneInside::keep_spare_columns(4));
    CHECK_THAT(SceneInside::keep_spare_columns(1'000'000).error().message, Contains("at most 4096"));
}

}  // namespace rapid

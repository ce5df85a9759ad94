#include "runtime/files/frame_pattern.h"

#include <fstream>

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("every way to write a frame number in a name is expanded and padded", "[files][pattern]")
{
    const auto name = [](const char* pattern, int frame) { return FramePattern(pattern).expand(frame); };
    CHECK(name("a.####.vdb", 7) == "a.0007.vdb");
    CHECK(name("a.##.vdb", 7) == "a.07.vdb");
    CHECK(name("a.##.vdb", 12345) == "a.12345.vdb");
    CHECK(name("a.#.vdb", 7) == "a.0007.vdb");  // a single # means four digits
    CHECK(name("a.$F4.vdb", 7) == "a.0007.vdb");
    CHECK(name("a.$F.vdb", 7) == "a.7.vdb");
    CHECK(name("a.$F3x.vdb", 7) == "a.007x.vdb");
    CHECK(name("a.%04d.vdb", 7) == "a.0007.vdb");
    CHECK(name("a.%d.vdb", 7) == "a.7.vdb");
    CHECK(name("a.####.vdb", -3) == "a.-0003.vdb");
    CHECK(name("a.####.vdb", 0) == "a.0000.vdb");
    CHECK(name("a.vdb", 7) == "a.vdb");
    CHECK(FramePattern("{output}/{output}.##.vdb").expand(1, "sparks") == "sparks/sparks.01.vdb");
}

TEST_CASE("a pattern that is not one frame number in a file's name is refused", "[files][pattern]")
{
    CHECK(error_of([] { FramePattern("a.%s.vdb"); }) ==
          "\"a.%s.vdb\": the % must be a frame number such as %04d; \\% is the character");
    CHECK(error_of([] { FramePattern("a.##.$F4.vdb"); }) == "\"a.##.$F4.vdb\" has two frame numbers; it must have one");
}

TEST_CASE("folders and escaped characters are no pattern, and neither is the name of an existing file",
          "[files][pattern]")
{
    const FramePattern pattern("shot#3/50%/$F/a\\#2_100\\%.####.vdb");
    CHECK(pattern.expand(7) == "shot#3/50%/$F/a#2_100%.0007.vdb");
    CHECK(pattern.without_frame() == "shot#3/50%/$F/a#2_100%.vdb");
    CHECK_FALSE(FramePattern("####/a\\$F.vdb").has_frame());
    CHECK(FramePattern("####/a\\$F.vdb").expand(7) == "####/a$F.vdb");
    CHECK(with_part("a\\#.####.vdb", "03of16") == "a\\#_part03of16.####.vdb");

    const TemporaryFolder folder;
    for (const char* name : {"take#2.obj", "100%.obj", "50%s.0003.obj"}) std::ofstream(folder / name) << "x";
    for (const char* name : {"take#2.obj", "100%.obj"}) {
        CAPTURE(name);
        const FramePattern of_file = FramePattern::of_files(folder / name);
        CHECK_FALSE(of_file.has_frame());
        CHECK(of_file.expand(7) == (folder / name).string());
        CHECK(of_file.existing().at(0) == folder / name);
    }
    CHECK(FramePattern::of_files(folder / "50\\%s.####.obj").existing().at(3) == folder / "50%s.0003.obj");
    CHECK(FramePattern::of_files(folder / "take#3.obj").has_frame());
    // An escape also names a single file, whether it exists or not.
    CHECK(FramePattern::of_files(folder / "take\\#2.obj").name() == (folder / "take#2.obj").string());
    CHECK(FramePattern("take\\#9.{output}.obj").name() == "take#9.{output}.obj");
    CHECK(FramePattern("take.####.obj").name() == "take.####.obj");
}

TEST_CASE("the existing files of a sequence are those that the pattern would write", "[files][pattern]")
{
    const TemporaryFolder folder;
    for (const char* name :
         {"a.0001.vdb", "a.0012.vdb", "a.10000.vdb", "a.12.vdb", "a.x.vdb", "b.0003.vdb", "a.0004.ply"})
        std::ofstream(folder / name) << "x";

    const auto found = FramePattern((folder / "a.####.vdb").string()).existing();

    REQUIRE(found.size() == 3);
    CHECK(found.at(1) == folder / "a.0001.vdb");
    CHECK(found.at(12) == folder / "a.0012.vdb");
    CHECK(found.at(10000) == folder / "a.10000.vdb");
    CHECK(FramePattern((folder / "none" / "a.####.vdb").string()).existing().empty());
    CHECK(FramePattern((folder / "b.0003.vdb").string()).existing().size() == 1);
}

TEST_CASE("the attributes after an output's file name are distinguished from colons in the name", "[files][pattern]")
{
    const OutputTarget plain = parse_output_target("out/a.####.vdb");
    CHECK(plain.pattern == "out/a.####.vdb");
    CHECK_FALSE(plain.attributes);

    const OutputTarget some = parse_output_target("out:1/a:b.####.vdb:age,Cd");
    CHECK(some.pattern == "out:1/a:b.####.vdb");
    CHECK(some.attributes == std::vector<std::string>{"age", "Cd"});

    CHECK_FALSE(parse_output_target("a:b.vdb").attributes);
    CHECK(parse_output_target("a.vdb:").attributes->empty());
}

TEST_CASE("the number of a part replaces {part}, or stands before the frame's number", "[files][pattern]")
{
    const auto part = [](const char* pattern) { return with_part(pattern, "03of16"); };
    CHECK(part("out/a.####.vdb") == "out/a_part03of16.####.vdb");
    CHECK(part("out.d/a_$F4.vdb") == "out.d/a_part03of16_$F4.vdb");
    CHECK(part("a-%04d.vdb") == "a_part03of16-%04d.vdb");
    CHECK(part("####.vdb") == "_part03of16####.vdb");
    CHECK(part("out.d/a.json") == "out.d/a_part03of16.json");
    CHECK(part("out.d/a") == "out.d/a_part03of16");
    CHECK(part("{part}/a.####.vdb") == "03of16/a.####.vdb");
    CHECK(part("{part}/{output}.{part}.####.vdb") == "03of16/{output}.03of16.####.vdb");
}

TEST_CASE("a sequence has a name without the number and its separator", "[files][pattern]")
{
    CHECK(FramePattern("out/a.####.vdb").without_frame() == "out/a.vdb");
    CHECK(FramePattern("out/{output}_$F.vdb").without_frame("left") == "out/left.vdb");
    CHECK(FramePattern("a.vdb").without_frame() == "a.vdb");
    CHECK(FramePattern("out/{output}.####.vdb").for_output("left") == "out/left.####.vdb");
}

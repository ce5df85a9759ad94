// Warnings of frames: which are printed as they occur, and which are only counted.
#include <fmt/format.h>

#include "runtime/report/frame_warnings.h"
#include "tests/test.h"

using namespace rapid;

TEST_CASE("the kind of a warning has its line and its names, but not its numbers", "[report]")
{
    CHECK(kind_of_warning("a.lua:12: node \"drag2\": moved 1.5e-06 m in 3 steps") ==
          "a.lua:12: node \"drag2\": moved # m in # steps");
    CHECK(kind_of_warning("from -1e+20 to 7.") == "from # to #.");
    CHECK(kind_of_warning("mesh \"a.12.obj\": 5e of 6") == "mesh \"a.12.obj\": #e of #");
    CHECK(kind_of_warning("a voxel of 5 m: it is 1 m long") == "a voxel of # m: it is # m long");
    CHECK(kind_of_warning("size 3: so") == "size #: so");
    CHECK(kind_of_warning("") == "");
    CHECK(kind_of_warning("12") == "#");
}

TEST_CASE("ten warnings that differ only in numbers are printed, and the last of the rest with its frame", "[report]")
{
    FrameWarnings warnings;
    int reported = 0;
    for (int frame = 1; frame <= 1000; ++frame) {
        reported += warnings.add(fmt::format("node \"a\": off by {} m", frame), frame);
        reported += warnings.add("node \"b\": the same", frame);
        if (frame == 5) reported += warnings.add("node \"c\": 1", frame);
    }
    CHECK(reported == 12);
    CHECK(
        warnings.suppressed() ==
        std::vector<std::string>{"990 more warnings of this kind, the last in frame 1000: node \"a\": off by 1000 m"});
}

TEST_CASE("a warning is not repeated, even after others of its kind", "[report]")
{
    FrameWarnings warnings;
    CHECK(warnings.add("off by 1 m", 1));
    CHECK(warnings.add("off by 2 m", 2));
    CHECK_FALSE(warnings.add("off by 1 m", 3));
    CHECK(warnings.suppressed().empty());
}

TEST_CASE("kinds of warnings without end are counted", "[report]")
{
    FrameWarnings warnings;
    std::size_t reported = 0;
    for (int i = 0; i < 5000; ++i) reported += warnings.add(fmt::format("mesh \"{}\" is open", i), i);
    CHECK(reported == FrameWarnings::max_kinds);
    CHECK(warnings.suppressed() == std::vector<std::string>{"4000 more warnings of other kinds"});
}

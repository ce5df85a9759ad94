#include "runtime/shapes/level_set/grid_sequence.h"

#include "tests/test.h"

using namespace rapid;
using Beyond = FrameSequence::Beyond;

namespace {

SequenceFiles files(std::initializer_list<int> frames, Beyond before = Beyond::Hold, Beyond after = Beyond::Hold,
                    int offset = 0)
{
    SequenceFiles sequence{{}, {.before = before, .after = after, .offset = offset}};
    for (const int frame : frames) sequence.files[frame] = "file";
    return sequence;
}

// Returns the interpolated value at a fraction of an interval, if the file of frame f holds the number f.
double value(const SequenceFiles& sequence, std::int64_t frame, double part)
{
    const SequenceFiles::Interval found = sequence.interval(frame);
    const double b = found.begin + part * (found.end - found.begin);
    return (found.a ? *found.a : 0) * (1 - b) + (found.b ? *found.b : 0) * b;
}

}  // namespace

TEST_CASE("between files a sequence goes on a straight line, whether or not each frame has one", "[grid_sequence]")
{
    for (const SequenceFiles& sequence : {files({3, 4, 5, 6, 7, 8, 9}), files({3, 5, 9}), files({3, 9})})
        for (int frame = 3; frame < 9; ++frame)
            for (const double part : {0.0, 0.25, 1.0}) CHECK(value(sequence, frame, part) == Approx(frame + part));
}

TEST_CASE("outside of its files a sequence holds, repeats, is mirrored, or is nothing", "[grid_sequence]")
{
    const auto at = [](Beyond outside, int frame) { return files({3, 4, 5, 6}, outside, outside).frame_of(frame); };
    CHECK(at(Beyond::Hold, -10) == 3);
    CHECK(at(Beyond::Hold, 99) == 6);
    CHECK(at(Beyond::None, 2) == std::nullopt);
    CHECK(at(Beyond::None, 7) == std::nullopt);
    const int repeated[] = {3, 4, 5, 6, 3, 4, 5, 6}, mirrored[] = {3, 4, 5, 6, 5, 4, 3, 4};
    for (int k = 0; k < 8; ++k) {
        CHECK(at(Beyond::Repeat, 3 + k) == repeated[k]);
        CHECK(at(Beyond::Repeat, 3 + k - 8) == repeated[k]);
        CHECK(at(Beyond::Mirror, 3 + k) == mirrored[k]);
        CHECK(at(Beyond::Mirror, 3 + k - 6) == mirrored[k]);
    }
    CHECK(files({5}, Beyond::Mirror, Beyond::Repeat).frame_of(77) == 5);
    CHECK(files({5}, Beyond::Mirror, Beyond::Repeat).frame_of(-77) == 5);
    CHECK(files({3, 4, 5, 6}, Beyond::Hold, Beyond::Hold, 10).frame_of(14) == 4);
}

TEST_CASE("a sequence goes on where one end meets the other", "[grid_sequence]")
{
    const SequenceFiles repeated = files({3, 4, 5, 6}, Beyond::Repeat, Beyond::Repeat);
    CHECK(value(repeated, 6, 0) == 6);
    CHECK(value(repeated, 6, 0.5) == Approx(4.5));  // from 6 to 3
    CHECK(value(repeated, 7, 0.5) == Approx(3.5));
    const SequenceFiles mirrored = files({3, 5, 6}, Beyond::Mirror, Beyond::Mirror);
    CHECK(value(mirrored, 7, 0.25) == Approx(4.75));  // 5 at frame 7, 4 at frame 8
    CHECK(value(mirrored, 2, 0.25) == Approx(3.75));  // 4 at frame 2
    const SequenceFiles held = files({3, 4}, Beyond::None, Beyond::Hold);
    CHECK(value(held, 1, 1) == 0);
    CHECK(value(held, 2, 0.5) == Approx(1.5));  // from no grid to 3
    CHECK(value(held, 8, 0.5) == 4);
}

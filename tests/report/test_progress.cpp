#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "runtime/report/progress.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// A stream that stores its text.
class Memory {
public:
    Memory() : file_(open_memstream(&text_, &size_)) {}
    ~Memory()
    {
        std::fclose(file_);
        std::free(text_);
    }
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    std::FILE* file() const { return file_; }
    std::string text() const
    {
        std::fflush(file_);
        return {text_, size_};
    }

private:
    char* text_ = nullptr;
    std::size_t size_ = 0;
    std::FILE* file_;
};

// A bar of 40 columns, the maximum.
std::string bar_of(int done) { return fmt::format("[{:=<{}}{: <{}}]", "", done, "", 40 - done); }

}  // namespace

TEST_CASE("a stream that is not a terminal gets lines", "[report]")
{
    Memory memory;
    CHECK(progress_style(memory.file()) == ProgressStyle::Lines);
}

TEST_CASE("a line a frame says its number, its points and its own time", "[report]")
{
    Memory memory;
    Progress progress(memory.file(), ProgressStyle::Lines, 1, 2);
    progress.frame(1, 0, 0.5);
    progress.frame(2, 1200, 0.75);
    progress.finish();
    CHECK(memory.text() == "frame 1  0 points  0.500 s\nframe 2  1,200 points  0.250 s\n");
}

TEST_CASE("a quiet run says nothing", "[report]")
{
    Memory memory;
    Progress progress(memory.file(), ProgressStyle::None, 1, 2);
    progress.frame(1, 10, 0.5);
    progress.line("writing a.0001.vdb");
    progress.finish();
    CHECK(memory.text().empty());
}

TEST_CASE("a bar is drawn at most twenty times a second, and for the last frame", "[report]")
{
    Memory memory;
    Progress progress(memory.file(), ProgressStyle::Bar, 1, 1000);
    for (int f = 1; f <= 1000; ++f) progress.frame(f, 10, 0.001 * f);
    const std::string text = memory.text();
    CHECK(std::count(text.begin(), text.end(), '\r') <= 21);
    CHECK(text.find("frame 1000/1000") != std::string::npos);
}

TEST_CASE("a line of text replaces the progress bar, which is drawn again below it", "[report]")
{
    Memory memory;
    Progress progress(memory.file(), ProgressStyle::Bar, 1, 2);
    progress.frame(1, 10, 1);
    const std::string bar = memory.text();
    progress.line("writing a.0001.vdb");
    CHECK(memory.text() == bar + "\r\x1b[K" + "writing a.0001.vdb\n" + bar);
    progress.finish();
    CHECK(memory.text().ends_with("\r\x1b[K"));
}

TEST_CASE("a bar fits any terminal", "[report]")
{
    for (int width = 0; width <= 200; ++width) {
        CAPTURE(width);
        CHECK(progress_bar(1234, 1, 100000, 123456789, 9.87e7, 3725, width).size() <= static_cast<std::size_t>(width));
    }
}

TEST_CASE("a wide terminal shows frame, points, points per second and time left", "[report]")
{
    const std::string bar = progress_bar(12, 1, 48, 20000, 3.214e6, 2.1, 120);
    CHECK(bar.ends_with(" frame 12/48  20,000 points  3.21 million points/s  2.1 s left"));
    // 12 of 48 frames: a quarter of the 40 columns.
    CHECK(bar.starts_with(bar_of(10)));
}

TEST_CASE("the bar is full at the last frame of a range that does not begin at 1", "[report]")
{
    CHECK(progress_bar(20, 11, 20, 0, 0, 0, 120).starts_with(bar_of(40)));
    CHECK(progress_bar(11, 11, 11, 0, 0, 0, 120).starts_with(bar_of(40)));
}

TEST_CASE("time left is what the newest frames took, times the frames to come", "[report]")
{
    Memory memory;
    Progress progress(memory.file(), ProgressStyle::Bar, 1, 11);
    progress.frame(1, 10, 2);
    CHECK(memory.text().find("20.0 s left") != std::string::npos);
}

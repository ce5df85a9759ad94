#include "runtime/report/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "runtime/base/printable.h"
#include "runtime/report/number_text.h"

namespace rapid {
namespace {

// s between two drawings: smooth to the eye, and cheap beside frames of a millisecond.
constexpr double redraw_interval = 0.05;
// Weight of the newest frame in the average: scenes grow, and the next frames cost about as much as the last ones.
constexpr double newest_share = 0.2;

int terminal_width(std::FILE* out)
{
    winsize size{};
    return ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

// Not fmt::print, which throws when the reader of a pipe has gone: the run must go on.
void put(std::FILE* out, std::string_view text) { std::fwrite(text.data(), 1, text.size(), out); }

}  // namespace

ProgressStyle progress_style(std::FILE* out)
{
    const char* term = std::getenv("TERM");
    const bool redrawable = isatty(fileno(out)) && term && std::string_view(term) != "dumb";
    return redrawable ? ProgressStyle::Bar : ProgressStyle::Lines;
}

Progress::Progress(std::FILE* out, ProgressStyle style, std::int64_t first, std::int64_t last)
    : out_(out), style_(style), first_(first), last_(last)
{
}

void Progress::frame(std::int64_t number, std::uint64_t points, double now)
{
    const double took = now - now_;
    frame_seconds_ = number == first_ ? took : frame_seconds_ + newest_share * (took - frame_seconds_);
    latest_ = number;
    points_ = points;
    now_ = now;
    if (style_ == ProgressStyle::Lines) {
        put(out_, fmt::format("frame {}  {} points  {:.3f} s\n", number, with_separators(points), took));
        std::fflush(out_);
    }
    if (style_ == ProgressStyle::Bar && (now - drawn_at_ >= redraw_interval || number == last_)) draw();
}

void Progress::line(const std::string& text)
{
    if (style_ == ProgressStyle::None) return;
    const bool was_drawn = drawn_;
    erase();
    put(out_, printable(text) + '\n');
    if (was_drawn) draw();
    std::fflush(out_);
}

void Progress::finish()
{
    erase();
    std::fflush(out_);
}

void Progress::draw()
{
    const double rate = frame_seconds_ > 0 ? static_cast<double>(points_) / frame_seconds_ : 0;
    const double left = frame_seconds_ * static_cast<double>(last_ - latest_);
    // The last column stays free: terminals wrap when it is filled.
    const std::string bar = progress_bar(latest_, first_, last_, points_, rate, left, terminal_width(out_) - 1);
    put(out_, "\r" + bar + "\x1b[K");
    std::fflush(out_);
    drawn_ = true;
    drawn_at_ = now_;
}

void Progress::erase()
{
    if (drawn_) put(out_, "\r\x1b[K");
    drawn_ = false;
}

std::string progress_bar(std::int64_t frame, std::int64_t first, std::int64_t last, std::uint64_t points,
                         double points_per_second, double seconds_left, int width)
{
    constexpr int min_bar = 10;
    std::vector<std::string> words = {
        fmt::format(" frame {}/{}", frame, last),
        fmt::format("  {} points", with_separators(points)),
        fmt::format("  {} points/s", in_millions(points_per_second)),
        fmt::format("  {} left", duration_text(seconds_left)),
    };
    const auto length = [&] {
        std::size_t sum = 0;
        for (const std::string& word : words) sum += word.size();
        return static_cast<int>(sum);
    };
    while (words.size() > 1 && length() + min_bar + 2 > width) words.pop_back();

    std::string text;
    if (const int room = width - length() - 2; room >= min_bar) {
        const int columns = std::min(room, 40);
        const auto done = static_cast<int>(columns * (frame - first + 1) / (last - first + 1));
        text = fmt::format("[{:=<{}}{: <{}}]", "", done, "", columns - done);
    }
    for (const std::string& word : words) text += word;
    return text.substr(0, static_cast<std::size_t>(std::max(0, width)));
}

}  // namespace rapid

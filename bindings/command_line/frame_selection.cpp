#include "bindings/command_line/frame_selection.h"

#include <fmt/format.h>

#include <charconv>

#include "runtime/base/error.h"

namespace rapid {

RunFrames read_frames(const std::string& text)
{
    const auto wrong = [&](const char* what) {
        return Error(fmt::format("-f {}: {}; it must be a frame (12), a range (1-48), or a range and a step (1-48x2)",
                                 text, what));
    };
    const char* at = text.data();
    const char* const end = at + text.size();
    const auto number = [&] {
        std::int32_t value = 0;  // the range of file formats and names
        const auto parsed = std::from_chars(at, end, value);
        if (parsed.ec == std::errc::result_out_of_range) throw wrong("a frame's number must fit 32 bits");
        if (parsed.ec != std::errc()) throw wrong("a number is missing");
        at = parsed.ptr;
        return std::int64_t{value};
    };

    RunFrames range{number(), 0};
    range.last = range.first;
    if (at == end) return range;
    if (*at++ != '-') throw wrong("a - is missing");
    range.last = number();
    if (range.last < range.first) throw wrong("it ends before it begins");
    if (at == end) return range;
    if (*at++ != 'x') throw wrong("an x is missing");
    range.step = number();
    if (range.step < 1) throw wrong("the step must be at least 1");
    if (at != end) throw wrong("there is more text after it");
    return range;
}

std::int64_t read_frame(const std::string& option, const std::string& text)
{
    std::int32_t frame = 0;
    const char* const end = text.data() + text.size();
    if (const auto parsed = std::from_chars(text.data(), end, frame); parsed.ec != std::errc() || parsed.ptr != end)
        throw Error(fmt::format("{} {}: it must be a frame number, such as 12", option, text));
    return frame;
}

void declare_frames(Options& options, std::optional<RunFrames>& frames, const std::string& doc)
{
    options
        .add_option(
            "-f,--frames", [&frames](const std::string& text) { frames = read_frames(text); }, doc)
        .type_name("FRAMES");
}

}  // namespace rapid

#include "runtime/files/frame_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <climits>
#include <system_error>

#include "runtime/base/error.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct FrameNumber {
    std::size_t begin, end;  // position in the text
    int digits;
};

// Reads the width that begins at `at` and moves `at` past it.
int read_width(const std::string& text, std::size_t& at)
{
    int width = 0;
    while (at < text.size() && is_digit(text[at]) && width < 100) width = 10 * width + (text[at++] - '0');
    return width;
}

// Returns the start of the last component of a path.
std::size_t start_of_name(std::string_view path)
{
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string_view::npos ? 0 : slash + 1;
}

// Returns true at a backslash that takes the next character literally.
bool is_escape(std::string_view text, std::size_t at)
{
    return text[at] == '\\' && at + 1 < text.size() &&
           std::string_view("#$%").find(text[at + 1]) != std::string_view::npos;
}

std::optional<FrameNumber> frame_number_at(const std::string& text, std::size_t begin)
{
    std::size_t end = begin;
    if (text[begin] == '#') {
        while (end < text.size() && text[end] == '#') ++end;
        const std::size_t count = end - begin;
        return FrameNumber{begin, end, count == 1 ? 4 : static_cast<int>(count)};
    }
    if (text[begin] == '$' && text.compare(begin, 2, "$F") == 0) {
        end = begin + 2;
        const int width = read_width(text, end);
        return FrameNumber{begin, end, std::max(1, width)};
    }
    if (text[begin] == '%') {
        end = begin + 1;
        const int width = read_width(text, end);
        if (end == text.size() || text[end] != 'd')
            throw Error(fmt::format("\"{}\": the % must be a frame number such as %04d; \\% is the character", text));
        return FrameNumber{begin, end + 1, std::max(1, width)};
    }
    return std::nullopt;
}

}  // namespace

FramePattern::FramePattern(std::string text) : text_(std::move(text))
{
    const std::size_t name = start_of_name(text_);
    std::string* part = &before_;
    for (std::size_t at = 0; at < text_.size(); ++at) {
        if (at >= name && is_escape(text_, at)) {
            *part += text_[++at];
            continue;
        }
        const std::optional<FrameNumber> number = at < name ? std::nullopt : frame_number_at(text_, at);
        if (!number) {
            *part += text_[at];
            continue;
        }
        if (digits_) throw Error(fmt::format("\"{}\" has two frame numbers; it must have one", text_));
        part = &after_;
        digits_ = number->digits;
        at = number->end - 1;
    }
}

FramePattern FramePattern::of_files(const std::filesystem::path& path)
{
    std::error_code none;
    if (!fs::exists(path, none)) return FramePattern(path.string());
    FramePattern literal;
    literal.text_ = literal.before_ = path.string();
    return literal;
}

namespace {

std::string with_value(std::string text, std::string_view variable, std::string_view value)
{
    for (std::size_t at = 0; (at = text.find(variable, at)) != std::string::npos; at += value.size())
        text.replace(at, variable.size(), value);
    return text;
}

std::string with_output(std::string text, std::string_view output)
{
    return with_value(std::move(text), "{output}", output);
}

constexpr std::string_view part_variable = "{part}";

// Returns the position of the dot, dash or underscore that ends the text, or the text's length if there is none.
std::size_t separator_before(std::string_view text)
{
    const bool separated = !text.empty() && std::string_view("._-").find(text.back()) != std::string_view::npos;
    return text.size() - separated;
}

}  // namespace

std::string FramePattern::expand(int frame, std::string_view output) const
{
    if (!digits_) return with_output(before_, output);
    // The minus sign does not count as a digit: -1 is -0001, as in Houdini.
    const std::string number =
        fmt::format("{}{:0{}}", frame < 0 ? "-" : "", std::abs(static_cast<long long>(frame)), *digits_);
    return with_output(before_, output) + number + with_output(after_, output);
}

std::string FramePattern::for_output(std::string_view output) const { return with_output(text_, output); }

std::string FramePattern::without_frame(std::string_view output) const
{
    if (!digits_) return with_output(before_, output);
    return with_output(before_.substr(0, separator_before(before_)), output) + with_output(after_, output);
}

std::map<int, fs::path> FramePattern::existing(std::string_view output) const
{
    std::map<int, fs::path> found;
    std::error_code error;
    if (!digits_) {
        const fs::path path = with_output(before_, output);
        if (fs::exists(path, error)) found.emplace(0, path);
        return found;
    }
    const fs::path prefix_path = with_output(before_, output);
    const fs::path folder = prefix_path.parent_path();
    const std::string prefix = prefix_path.filename().string(), suffix = with_output(after_, output);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
        const std::string name = entry.path().filename().string();
        if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) || !name.ends_with(suffix))
            continue;
        const std::string number = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
        int frame = 0;
        const auto parsed = std::from_chars(number.data(), number.data() + number.size(), frame);
        if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size()) continue;
        // Accepts only the name that this pattern would produce: 7 and 0007 are different files.
        if (fs::path(expand(frame, output)).filename() == name) found.emplace(frame, folder / name);
    }
    return found;
}

bool has_part(std::string_view pattern) { return pattern.find(part_variable) != std::string_view::npos; }

std::string part_name(int number, int count)
{
    const std::string last = fmt::format("{}", count);
    return fmt::format("{:0{}}of{}", number, last.size(), last);
}

std::string with_part(const std::string& pattern, std::string_view part)
{
    if (has_part(pattern)) return with_value(pattern, part_variable, part);
    const std::size_t name = start_of_name(pattern);
    std::size_t place = pattern.size();
    for (std::size_t at = name; at < pattern.size() && place == pattern.size(); ++at)
        if (is_escape(pattern, at))
            ++at;
        else if (frame_number_at(pattern, at))
            place = separator_before(std::string_view(pattern).substr(0, at));
    if (place == pattern.size())
        if (const std::size_t dot = pattern.find_last_of('.'); dot != std::string::npos && dot > name) place = dot;
    return fmt::format("{}_part{}{}", pattern.substr(0, place), part, pattern.substr(place));
}

OutputTarget parse_output_target(const std::string& text)
{
    // Attributes follow the last colon of the file's name, after the extension. C:/x.vdb and a:b.vdb have none.
    const std::size_t name = start_of_name(text);
    const std::size_t colon = text.find_last_of(':');
    const bool has_attributes =
        colon != std::string::npos && colon > name && text.find('.', colon) == std::string::npos;
    if (!has_attributes) return {text, std::nullopt};

    OutputTarget target{text.substr(0, colon), std::vector<std::string>()};
    const std::string list = text.substr(colon + 1);
    for (std::size_t begin = 0; begin < list.size();) {
        const std::size_t end = std::min(list.find(',', begin), list.size());
        if (end > begin) target.attributes->push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return target;
}

}  // namespace rapid

#include "bindings/command/part_options.h"

#include <fmt/format.h>

#include <charconv>

#include "runtime/files/frame_pattern.h"

namespace rapid {
namespace {

std::optional<int> parse_integer(std::string_view text)
{
    int number = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return {};
    return number;
}

RunPart read_part(const std::string& text)
{
    const std::size_t slash = text.find('/');
    const std::optional<int> number = parse_integer(text.substr(0, slash));
    const std::optional<int> count = slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
    if (!number || !count || *count < 1 || *count > max_parts || *number < 1 || *number > *count)
        throw Error(
            fmt::format("--part = \"{}\"; it must be K/N, with K from 1 to N, and N at most {}", text, max_parts));
    return {*number, *count};
}

double read_sample(const std::string& text)
{
    const double fraction = read_positive("--sample", text);
    if (fraction > 1)
        throw Error(fmt::format("--sample = \"{}\"; it must be a fraction of all points, above 0 and at most 1", text));
    return fraction;
}

}  // namespace

void PartOptions::declare(Options& options)
{
    options
        .add_option(
            "--part", [this](const std::string& text) { part_ = read_part(text); },
            "simulates one of N subsets of the points, which `rapid merge` joins; file names get _part03of16 before "
            "the frame number, or 03of16 instead of {part}")
        .type_name("K/N");
    options
        .add_option(
            "--sample", [this](const std::string& text) { sample_ = read_sample(text); },
            "simulates this fraction of the points, 0.01 for a hundredth: a preview with the same ids and paths")
        .type_name("FRACTION");
}

}  // namespace rapid

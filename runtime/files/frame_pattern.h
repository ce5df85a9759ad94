// Patterns of file names for a sequence of frames: `####` (a digit each; a single # means four), $F4 or $F, %04d or %d;
// {output}, the name of a graph's output; and {part}, that of a part of the points.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

class FramePattern {
public:
    // Error: a `%` that is not a frame number (%s); more than one frame number in the file's name.
    explicit FramePattern(std::string text);

    const std::string& text() const { return text_; }
    // Whether the name depends on the frame, and on the output.
    bool has_frame() const { return digits_.has_value(); }
    bool has_output() const { return text_.find("{output}") != std::string::npos; }

    std::string expand(int frame, std::string_view output = "main") const;
    // The pattern of one output.
    std::string of_output(std::string_view output) const;
    // Of all frames: without the number, and the dot, dash or low line before it.
    std::string without_frame(std::string_view output = "main") const;

    // The existing files, by frame. A number may have more digits than the pattern (10000 for ####).
    std::map<int, std::filesystem::path> existing(std::string_view output = "main") const;

private:
    std::string text_;
    std::string before_, after_;  // of the frame number
    std::optional<int> digits_;   // least width of the number
};

// The pattern of a part, "03of16": in place of {part}; where that is not there, as _part03of16 before the frame's
// number, or before the extension.
std::string with_part(const std::string& pattern, std::string_view part);
bool has_part(std::string_view pattern);

constexpr int most_parts = 100000;

// "03of16": the number as wide as the count, so that names are in order.
std::string part_name(int number, int count);

// The target of `-o FILE:ATTR,ATTR`.
struct OutputTarget {
    std::string pattern;
    // Only P, v, id and these attributes and groups; nothing: all.
    std::optional<std::vector<std::string>> attributes;
};
OutputTarget parse_output_target(const std::string& text);

}  // namespace rapid

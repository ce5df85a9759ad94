// Patterns of file names for a sequence of frames: `####` (one digit each, but a single # means four), $F4 or $F, %04d
// or %d, in the last component of a path. A backslash before #, $ or % takes it literally. {output} is the name of a
// graph's output, and {part} that of a part of the points.
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
    // Throws Error if a `%` is not a frame number (%s), or if the file's name has more than one frame number.
    explicit FramePattern(std::string text);

    // Returns the pattern of files that are read. The name of an existing file is not a pattern, whatever it contains.
    static FramePattern of_files(const std::filesystem::path& path);

    const std::string& text() const { return text_; }
    // Return true if the name depends on the frame, and on the output.
    bool has_frame() const { return digits_.has_value(); }
    bool has_output() const { return text_.find("{output}") != std::string::npos; }
    // Returns the name of the only file: the text without the backslashes of escapes. A pattern with a frame number is
    // returned unchanged.
    const std::string& name() const { return has_frame() ? text_ : before_; }

    std::string expand(int frame, std::string_view output = "main") const;
    // Returns the pattern for one output.
    std::string for_output(std::string_view output) const;
    // Returns the name for all frames: without the number and the dot, dash or underscore before it.
    std::string without_frame(std::string_view output = "main") const;

    // Returns the existing files by frame. A number may have more digits than the pattern (10000 for ####).
    std::map<int, std::filesystem::path> existing(std::string_view output = "main") const;

private:
    FramePattern() = default;

    std::string text_;
    std::string before_, after_;  // text around the frame number, without backslashes; before_ is all if there is none
    std::optional<int> digits_;   // minimum digits of the number
};

// Returns the pattern for a part, such as "03of16". The part replaces {part}. Without {part}, _part03of16 is inserted
// before the frame number, or before the extension.
std::string with_part(const std::string& pattern, std::string_view part);
bool has_part(std::string_view pattern);

constexpr int max_parts = 100000;

// Returns "03of16". The number is as wide as the count, so that names sort in order.
std::string part_name(int number, int count);

// The target of `-o FILE:ATTR,ATTR`.
struct OutputTarget {
    std::string pattern;
    // Attributes and groups to write in addition to P, v and id. If absent, all are written.
    std::optional<std::vector<std::string>> attributes;
};
OutputTarget parse_output_target(const std::string& text);

}  // namespace rapid

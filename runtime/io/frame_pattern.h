// File names of a sequence of frames: `####` (one digit each; a lone # means four), $F4 or $F, %04d or %d, and
// {output}, the name of a graph's output.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

class FramePattern {
public:
    // Error: a `%` that is no frame (%s), more than one frame number in the file's name.
    explicit FramePattern(std::string text);

    const std::string& text() const { return text_; }
    // Whether the names of two frames differ; of two outputs.
    bool has_frame() const { return digits_.has_value(); }
    bool has_output() const { return text_.find("{output}") != std::string::npos; }

    std::string expand(int frame, std::string_view output = "main") const;

    // The files that exist, by frame. A number with more digits than the pattern has is a frame too (10000 of ####).
    std::map<int, std::filesystem::path> existing(std::string_view output = "main") const;

private:
    std::string text_;
    std::string before_, after_;  // of the frame number
    std::optional<int> digits_;   // its least width
};

// What `-o FILE:ATTR,ATTR` says.
struct OutputTarget {
    std::string pattern;
    // P, v and id, and these attributes and groups alone; null: all.
    std::optional<std::vector<std::string>> attributes;
};
OutputTarget parse_output_target(const std::string& text);

// The points with P, v, id and the named attributes and groups alone. Error: a name that is neither, with the nearest.
PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names);

}  // namespace rapid

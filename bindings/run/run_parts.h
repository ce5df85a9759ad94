// The parts of a run, put together frame by frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bindings/run/part_record.h"

namespace rapid {

class RunParts {
public:
    // patterns: of the parts, as -o of their runs had them; {part} stands for all parts. Error: what is missing,
    // doubled or does not fit, all of it; files that hold no points.
    explicit RunParts(const std::vector<std::string>& patterns);

    std::size_t count() const { return parts_.size(); }
    // In order.
    std::vector<int> frames() const;

    // Error: a pattern for files that hold no points, that all frames would go to, or that would replace a part.
    void check_output(const std::string& output) const;
    // Writes a frame of the whole to its file of the pattern, and gives the number of its points. Meanwhile large
    // columns of the whole process may lie in files (column_files.h).
    std::uint64_t write_frame(int frame, const std::string& output) const;

private:
    // One part: its sequence, and what is known of it.
    struct PartFiles {
        std::string text;  // the pattern
        PartRecord record;
        std::map<int, std::filesystem::path> frames;
    };
    static void find_missing(const std::map<int, PartFiles>& parts, int count, std::vector<std::string>& problems);
    static void find_frames(PartFiles& part, std::vector<std::string>& problems);

    std::vector<PartFiles> parts_;  // in order of their numbers
};

}  // namespace rapid

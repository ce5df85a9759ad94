// Merges the parts of a run, frame by frame.
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
    // patterns: of the parts, as in -o of their runs; {part} stands for all parts. Throws Error with everything that is
    // missing, duplicate or inconsistent, or if the files do not hold points.
    explicit RunParts(const std::vector<std::string>& patterns);

    std::size_t count() const { return parts_.size(); }
    // Returns the frames in order.
    std::vector<int> frames() const;

    // Throws Error for a pattern whose files do not hold points, that all frames would share, or that would replace a
    // part.
    void check_output(const std::string& output) const;
    // Writes a merged frame to its file of the pattern, and returns its number of points. Meanwhile large columns of
    // the whole process may be stored in files (column_files.h).
    std::uint64_t write_frame(int frame, const std::string& output) const;

private:
    // A part: its sequence and its record.
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

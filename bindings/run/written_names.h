// The names of the files that a run writes. If two writers shared a name, one's output would be lost, and a run must
// not overwrite its inputs: both are errors.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "include/rapid/run.h"
#include "runtime/files/frame_pattern.h"

namespace rapid {

class WrittenNames {
public:
    // Adds a file that the run reads before its first frame.
    void reads(const std::filesystem::path& file);
    // Adds one file. who: "statistics". Throws Error if it is read, or belongs to another writer.
    void add(const std::filesystem::path& file, std::string who);
    // Adds one file for each frame, or for all if the pattern has no frame number. who: "output x.####.csv".
    void add(const FramePattern& pattern, std::string_view output, const RunFrames& frames, std::string who);

private:
    struct Writer {
        std::filesystem::path folder;
        std::string name;
        std::optional<FramePattern> pattern;  // of the name
        RunFrames frames;
        std::string who;
    };
    std::optional<std::string> common_name(const Writer& a, const Writer& b) const;
    std::optional<std::string> name_of_file(const Writer& writer, const std::filesystem::path& file) const;
    void check(const Writer& writer) const;

    std::set<std::filesystem::path> read_;
    std::vector<Writer> writers_;
};

// Notes in the folder that the file belongs to `who`, among processes. Throws Error if it belongs to another.
void claim_among_processes(const std::filesystem::path& folder, const std::string& who,
                           const std::filesystem::path& file);

}  // namespace rapid

// The names that a run writes to. Where two writers had one name, what one of them wrote would be lost, and what the
// run reads is not its own: both are errors.
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
    // What the run reads before its first frame.
    void reads(const std::filesystem::path& file);
    // One file. who: "statistics". Error: it is read, or another's.
    void add(const std::filesystem::path& file, std::string who);
    // One file for each frame, or of all where the pattern has no frame number. who: "output x.####.csv".
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

// Among processes: notes in the folder that the file is that of `who`. Error: it is another's.
void claim_among_processes(const std::filesystem::path& folder, const std::string& who,
                           const std::filesystem::path& file);

}  // namespace rapid

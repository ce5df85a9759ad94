// Collects the warnings of a run's frames in bounded memory: a repeated warning with other numbers is counted.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

// Returns the common form of warnings that differ only in numbers. Numbers in a place (FILE:LINE: ) and in quoted names
// remain.
std::string kind_of_warning(std::string_view text);

class FrameWarnings {
public:
    static constexpr std::size_t max_kinds = 1000, printed_of_each = 10;

    // Adds a warning. Returns true if it should be printed now: the first ten of a kind are, each once.
    bool add(const std::string& text, std::int64_t frame);

    // Returns summaries for the end of the run, in the order of their frames: for each kind the number of further
    // warnings and the last of them; then the number of warnings of further kinds.
    std::vector<std::string> suppressed() const;

private:
    struct Kind {
        std::vector<std::string> printed;
        std::uint64_t suppressed = 0;
        std::string last;        // the last one that was not printed
        std::int64_t frame = 0;  // its frame
    };
    std::map<std::string, Kind> kinds_;
    std::uint64_t others_ = 0;
};

}  // namespace rapid

// The warnings of a run's frames, in bounded memory: one that comes again with other numbers is counted.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

// What warnings that differ in numbers alone have in common: those of a place (FILE:LINE: ) and in quotes, of names,
// are kept.
std::string kind_of_warning(std::string_view text);

class FrameWarnings {
public:
    static constexpr std::size_t most_kinds = 1000, told_of_each = 10;

    // Whether it is to be told now, as the first ten of a kind are, each once.
    bool add(const std::string& text, std::int64_t frame);

    // For the end, in the order of their frames: of each kind how many more there were, and the last of them. Then how
    // many warnings were of further kinds than the most.
    std::vector<std::string> untold() const;

private:
    struct Kind {
        std::vector<std::string> told;
        std::uint64_t untold = 0;
        std::string last;        // of those that were not told
        std::int64_t frame = 0;  // its frame
    };
    std::map<std::string, Kind> kinds_;
    std::uint64_t others_ = 0;
};

}  // namespace rapid

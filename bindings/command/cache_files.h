// What a user names as a cache: one file, or the pattern of a sequence of them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace rapid {

struct CacheFiles {
    std::string text;
    bool sequence = false;
    std::map<int, std::filesystem::path> frames;  // one, numbered 0, where it is no sequence
};

// Error: nothing is there by that name, or it is a folder.
CacheFiles find_cache(const std::string& text);

}  // namespace rapid

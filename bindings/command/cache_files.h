// A cache by the name that a user gives: one file, or the pattern of a sequence of files.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace rapid {

struct CacheFiles {
    std::string text;
    bool sequence = false;
    std::map<int, std::filesystem::path> frames;  // a single file has the number 0
};

// Error: no such file, or it is a folder.
CacheFiles find_cache(const std::string& text);

}  // namespace rapid

// A cache named by the user: one file, or the pattern of a sequence of files.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bindings/command_line/process_sandbox.h"

namespace rapid {

struct CacheFiles {
    std::string text;
    bool sequence = false;
    std::map<int, std::filesystem::path> frames;  // a single file has the number 0
};

// Throws Error if the file does not exist, or is a folder.
CacheFiles find_cache(const std::string& text);

// Returns the files that a sandboxed process reads: a file, or the folder of a sequence. Missing names are left to
// find_cache().
SandboxAccess access_to_caches(const std::vector<std::string>& strings);

}  // namespace rapid

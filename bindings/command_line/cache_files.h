// A cache by the name that a user gives: one file, or the pattern of a sequence of files.
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

// Error: no such file, or it is a folder.
CacheFiles find_cache(const std::string& text);

// What a sandboxed process reads of them: a file, or the folder of a sequence. A name that is not there is left to
// find_cache().
SandboxAccess access_to_caches(const std::vector<std::string>& texts);

}  // namespace rapid

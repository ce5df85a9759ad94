#include "bindings/command_line/cache_files.h"

#include <fmt/format.h>

#include "bindings/command_line/untrusted.h"
#include "runtime/files/frame_pattern.h"

namespace rapid {

CacheFiles find_cache(const std::string& text)
{
    std::error_code none;  // for invalid names
    // A file whose name looks like a pattern takes precedence.
    if (std::filesystem::is_directory(text, none))
        throw Error("is a folder; name a file, or a sequence such as cache.####.vdb").at({text, 0});
    if (std::filesystem::exists(text, none)) return {text, false, {{0, text}}};
    const FramePattern pattern(text);
    if (!pattern.has_frame()) {
        if (!std::filesystem::exists(pattern.name(), none)) throw Error("no such file").at({text, 0});
        return {text, false, {{0, pattern.name()}}};
    }
    CacheFiles found{text, true, pattern.existing()};
    if (found.frames.empty())
        throw Error(fmt::format("no frame of this sequence exists; the first would be {}", pattern.expand(1)))
            .at({text, 0});
    return found;
}

SandboxAccess access_to_caches(const std::vector<std::string>& strings)
{
    SandboxAccess access;
    std::error_code none;
    for (const std::string& text : strings) {
        const std::filesystem::path path =
            std::filesystem::exists(text, none) ? std::filesystem::path(text) : folder_of(text);
        if (std::filesystem::exists(path, none)) access.readable.push_back(path);
    }
    return access;
}

}  // namespace rapid

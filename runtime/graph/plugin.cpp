#include "runtime/graph/plugin.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>

#include "runtime/base/path_list.h"
#include "runtime/files/input_file.h"
#include "runtime/graph/abi.h"
#include "runtime/graph/registry.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

std::string text_of(const std::string& file)
{
    try {
        return std::string(InputFile(file).text());
    } catch (const Error& error) {
        throw Error(fmt::format("{}: the plugin {}", file, error.message()), error.kind());
    }
}

// Returns the mark of RAPID_PLUGIN in a file; empty if there is none.
std::string mark_of(const std::string& file)
{
    const std::string bytes = text_of(file);
    const std::size_t at = bytes.find(RAPID_PLUGIN_MARK);
    if (at == std::string::npos) return "";
    const std::size_t begin = at + std::strlen(RAPID_PLUGIN_MARK);
    return bytes.substr(begin, std::min<std::size_t>(bytes.find('\0', begin) - begin, 256));
}

std::vector<std::string>& loaded()
{
    static std::vector<std::string> files;
    return files;
}

}  // namespace

const std::vector<std::string>& loaded_plugins() { return loaded(); }

void load_plugin(const std::string& file)
{
    const std::string built = mark_of(file);
    if (built.empty())
        throw Error(fmt::format(
            "{}: not a plugin of Rapid; one of its sources must contain RAPID_PLUGIN (runtime/graph/plugin.h)", file));
    if (built != RAPID_ABI)
        throw Error(fmt::format("{}: the plugin was built for Rapid {}; this is Rapid {}: build it again", file, built,
                                RAPID_ABI));
    // An absolute path, because the loader would otherwise search the library folders.
    if (!dlopen(fs::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL)) {
        const char* why = dlerror();
        throw Error(fmt::format("{}: the plugin can't be loaded: {}", file, why ? why : "no reason given"));
    }
    try {
        Registry();
    } catch (const Error& error) {
        throw Error(fmt::format("{}: {}", file, error.message()), error.kind());
    }
    loaded().push_back(file);
}

void load_plugins(const std::string& path)
{
    for (const std::string& part : parts_of_path_list(path)) {
        if (std::error_code none; !fs::is_directory(part, none)) {
            load_plugin(part);
            continue;
        }
        std::vector<std::string> files;
        for (const auto& entry : fs::directory_iterator(part))
            if (entry.path().extension() == ".so") files.push_back(entry.path().string());
        std::sort(files.begin(), files.end());
        for (const std::string& file : files) load_plugin(file);
    }
}

const char* library_abi() { return RAPID_ABI; }

}  // namespace rapid

#include "bindings/host/modules.h"

#include <dirent.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <memory>
#include <new>

#include "runtime/base/error.h"
#include "runtime/base/path_list.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

constexpr std::size_t max_text_bytes = std::size_t{64} << 20;  // bytes; more is no program but a device or sparse file

Error too_long(const std::filesystem::path& path)
{
    return Error("the file has more than 64 MiB, too much for a scene or a module").at({shown(path), 0});
}

// Reads a module, which others may have put next to the scene. Only regular files are read: a pipe would block.
std::optional<std::string> read_module(const std::filesystem::path& path)
{
    try {
        if (check_readable(path) > max_text_bytes) throw too_long(path);
        return std::string(InputFile(path).text());
    } catch (const Error& error) {
        if (error.location().file.empty()) return std::nullopt;  // it does not exist
        throw;
    }
}

// Returns the path of the program or library that contains this code, without symbolic links.
std::filesystem::path own_file()
{
    Dl_info here{};
    link_map* map = nullptr;
    dladdr1(reinterpret_cast<const void*>(&lua_folder), &here, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP);
    const bool in_library = map && *map->l_name != '\0';
    std::error_code missing;
    return std::filesystem::canonical(in_library ? map->l_name : "/proc/self/exe", missing);
}

}  // namespace

std::vector<std::filesystem::path> rapid_path()
{
    const std::vector<std::string> parts = path_list_of("RAPID_PATH");
    return {parts.begin(), parts.end()};
}

std::filesystem::path lua_folder()
{
    static const std::filesystem::path folder = [] {
        std::error_code ignored;
        // bin/rapid, or lib/x86_64-linux-gnu/librapid_host.so: `share` is next to one of the folders above. A build
        // folder has links to the sources there.
        for (auto above = own_file().parent_path(); above.has_relative_path(); above = above.parent_path()) {
            const auto installed = above.parent_path() / "share/rapid/lua";
            if (std::filesystem::exists(installed / "host.lua", ignored)) return std::filesystem::canonical(installed);
            if (above.filename() == "bin" || above.filename().string().starts_with("lib")) break;
        }
        throw Error(fmt::format("{}: Rapid's Lua files are missing; they belong in share/rapid/lua, next to its folder",
                                shown(own_file())));
    }();
    return folder;
}

std::optional<std::string> read_lua_file(const std::filesystem::path& path)
{
    std::error_code none;
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file && errno == ENOMEM) throw std::bad_alloc();
    if (!file || std::filesystem::is_directory(path, none)) return std::nullopt;
    std::string text;
    for (char block[1 << 16]; file;) {
        file.read(block, sizeof block);
        text.append(block, static_cast<std::size_t>(file.gcount()));
        if (text.size() > max_text_bytes) throw too_long(path);
    }
    return text;
}

std::string shown(const std::filesystem::path& path) { return path.lexically_normal().string(); }

std::optional<Modules::Source> Modules::find(std::string_view name, bool node, std::string& looked_in) const
{
    // A name is a path of words, so it cannot leave the searched folders.
    std::string relative(name);
    const bool words = !relative.empty() && std::all_of(relative.begin(), relative.end(), [](unsigned char c) {
        return std::isalnum(c) || c == '_' || c == '-' || c == '.';
    });
    if (!words || relative.find("..") != std::string::npos) {
        looked_in = "nothing, because the name of a module must consist of letters, digits, _ and dots";
        return std::nullopt;
    }
    std::replace(relative.begin(), relative.end(), '.', '/');

    const auto& [graph, on_read, further, text_of] = paths_;
    if (text_of)
        if (std::optional<std::string> text = text_of(std::string(name)))
            return Source{std::move(*text), std::string(name)};
    std::vector<std::filesystem::path> folders = {graph.parent_path()};
    folders.insert(folders.end(), further.begin(), further.end());
    for (const std::filesystem::path& extra : rapid_path()) folders.push_back(extra);
    if (node) folders.push_back(lua_folder() / "nodes");
    for (const std::filesystem::path& where : folders) {
        const std::filesystem::path path = where / (relative + ".lua");
        if (std::error_code ignored; !graph.empty() && std::filesystem::equivalent(path, graph, ignored)) continue;
        if (on_read) on_read(path);
        if (std::optional<std::string> text = read_module(path)) return Source{std::move(*text), shown(path)};
        looked_in += (looked_in.empty() ? "" : ", ") + shown(path);
    }
    return std::nullopt;
}

// Uses the system's own directory functions: libstdc++'s iterator ends the process when memory runs out.
std::vector<std::string> shipped_nodes()
{
    std::vector<std::string> names;
    const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir((lua_folder() / "nodes").c_str()), closedir);
    if (!folder) return names;
    while (const dirent* entry = readdir(folder.get())) {
        const std::filesystem::path file = entry->d_name;
        if (file.extension() == ".lua") names.push_back(file.stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace rapid

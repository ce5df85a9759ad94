// Lua files that graph code may load: modules and nodes next to the graph, on RAPID_PATH, and Rapid's own nodes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

// Returns the folder of Rapid's Lua files: share/rapid/lua next to the folder of the program or of the library. Throws
// if they are not there.
std::filesystem::path lua_folder();

// Returns the text of a file, or nothing if it cannot be read.
std::optional<std::string> read_lua_file(const std::filesystem::path& path);

// Returns a path for messages: `graphs/sparks.lua` stays as the user typed it, and a module next to it has the same
// form.
std::string shown(const std::filesystem::path& path);

// Returns the folders of RAPID_PATH, in order.
std::vector<std::filesystem::path> rapid_path();

class Modules {
public:
    struct SearchPaths {
        std::filesystem::path graph;                                     // modules are looked up next to it
        std::function<void(const std::filesystem::path& file)> on_read;  // receives each file looked for; may be empty
        std::vector<std::filesystem::path> folders = {};                 // searched before those of RAPID_PATH
        std::function<std::optional<std::string>(const std::string& name)> text = {};  // tried first; may be empty
    };
    explicit Modules(SearchPaths paths) : paths_(std::move(paths)) {}

    struct Source {
        std::string text, name;  // name: as shown in messages
    };
    // node: also searches Rapid's own nodes. Returns nothing if there is none; looked_in then has the paths tried.
    std::optional<Source> find(std::string_view name, bool node, std::string& looked_in) const;

private:
    const SearchPaths paths_;
};

// Returns the names of Rapid's own nodes written in Lua.
std::vector<std::string> shipped_nodes();

}  // namespace rapid

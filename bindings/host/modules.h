// The Lua files that graph code may load: modules and nodes beside the graph, on RAPID_PATH, and Rapid's own nodes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

// Where Rapid's Lua files are: beside the installed program, else in the source tree.
std::filesystem::path lua_folder();

// The text of a file; none where it can't be read.
std::optional<std::string> read_lua_file(const std::filesystem::path& path);

// `graphs/sparks.lua` stays as the user typed it; a module beside it is shown the same way.
std::string shown(const std::filesystem::path& path);

// The folders of RAPID_PATH, in order.
std::vector<std::filesystem::path> rapid_path();

class Modules {
public:
    // on_read: told of each place where a file is looked for; may be empty.
    Modules(std::filesystem::path graph, std::function<void(const std::filesystem::path& file)> on_read)
        : graph_(std::move(graph)), on_read_(std::move(on_read))
    {
    }

    struct Source {
        std::string text, name;  // name: as messages show it
    };
    // node: among Rapid's own nodes, too. None, with the files that were tried in looked_in.
    std::optional<Source> find(std::string_view name, bool node, std::string& looked_in) const;

private:
    const std::filesystem::path graph_;
    const std::function<void(const std::filesystem::path& file)> on_read_;
};

// The names of Rapid's own nodes written in Lua.
std::vector<std::string> shipped_nodes();

}  // namespace rapid

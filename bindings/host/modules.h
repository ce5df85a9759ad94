// The Lua files that graph code may load: modules and nodes beside the graph, on RAPID_PATH, and Rapid's own nodes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rapid {

// Where Rapid's Lua files are: in share/rapid/lua beside the folder of the program, or of the library. Error: they are
// not there.
std::filesystem::path lua_folder();

// The text of a file; none where it can't be read.
std::optional<std::string> read_lua_file(const std::filesystem::path& path);

// `graphs/sparks.lua` stays as the user typed it; a module beside it is shown the same way.
std::string shown(const std::filesystem::path& path);

// The folders of RAPID_PATH, in order.
std::vector<std::filesystem::path> rapid_path();

class Modules {
public:
    struct Places {
        std::filesystem::path graph;                                     // beside which they are
        std::function<void(const std::filesystem::path& file)> on_read;  // told of each file looked for; may be empty
        std::vector<std::filesystem::path> folders = {};                 // before those of RAPID_PATH
        std::function<std::optional<std::string>(const std::string& name)> text = {};  // asked first; may be empty
    };
    explicit Modules(Places places) : places_(std::move(places)) {}

    struct Source {
        std::string text, name;  // name: as messages show it
    };
    // node: among Rapid's own nodes, too. None, with the files that were tried in looked_in.
    std::optional<Source> find(std::string_view name, bool node, std::string& looked_in) const;

private:
    const Places places_;
};

// The names of Rapid's own nodes written in Lua.
std::vector<std::string> shipped_nodes();

}  // namespace rapid

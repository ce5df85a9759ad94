#include "bindings/host/own_nodes.h"

#include <filesystem>
#include <lua.hpp>
#include <set>

#include "bindings/host/lua_text.h"
#include "bindings/host/modules.h"
#include "bindings/host/script_host.h"

namespace rapid {
namespace {

// Returns true if a file defines a node: scenes and modules may lie next to it.
bool defines_node(const std::filesystem::path& file)
{
    std::error_code none;
    if (file.extension() != ".lua" || !std::filesystem::is_regular_file(file, none)) return false;
    const std::optional<std::string> text = read_lua_file(file);
    return text && text->find("rapid.node") != std::string::npos;
}

std::set<std::string> own_nodes()
{
    std::vector<std::filesystem::path> folders = rapid_path();
    folders.insert(folders.begin(), ".");
    std::set<std::string> names;
    for (const std::filesystem::path& folder : folders) {
        std::error_code unreadable;
        for (const auto& entry : std::filesystem::directory_iterator(folder, unreadable))
            if (defines_node(entry.path())) names.insert(entry.path().stem().string());
    }
    return names;
}

}  // namespace

NodeTypes with_own_nodes()
{
    ScriptHost host({}, SessionOptions{});
    host.load_shipped_nodes();
    NodeTypes types;
    for (const std::string& name : own_nodes()) {
        host.main().push_entry("load_node");
        push_text(host.main().lua(), name);
        try {
            host.main().call(1, 0);
        } catch (const Error& error) {
            types.faults.push_back(error.what());
        }
    }
    types.registry = host.registry;
    return types;
}

}  // namespace rapid

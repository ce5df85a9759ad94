// rapid new: makes a scene that runs, a test that passes, and the settings by which editors and luacheck know Rapid.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bindings/command_line/command.h"
#include "bindings/scene/installation.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Returns a file of lua/new, with NAME replaced by the scene's name.
std::string fill_in(const fs::path& lua, const char* file, const std::string& name)
{
    const fs::path path = lua / "new" / file;
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw Error("can't be read: Rapid's own Lua files are missing").at({path.string(), 0});
    std::stringstream text;
    text << stream.rdbuf();
    std::string filled = text.str();
    constexpr std::string_view placeholder = "NAME";
    for (std::size_t at = 0; (at = filled.find(placeholder, at)) != std::string::npos; at += name.size())
        filled.replace(at, placeholder.size(), name);
    return filled;
}

// Makes a file. Returns false if it exists already. Throws Error if it cannot be written; nothing is left of it then.
bool make_file(const std::string& path, const std::string& text)
{
    try {
        OutputFile file(path);
        file.append(text.data(), text.size());
        return file.finish_unless_taken();
    } catch (Error& error) {
        throw error.at({path, 0});
    }
}

class New : public Command {
public:
    std::string name() const override { return "new"; }
    std::string doc() const override { return "makes a scene and its test in this folder, as a start"; }

    void declare(Options& options) override
    {
        options.add_option("NAME", name_, "name of the scene, such as sparks: makes sparks.lua and test_sparks.lua")
            .type_name("")
            .required();
    }

    int run(const CommonOptions&) override
    {
        check_name();
        const std::string scene = name_ + ".lua", test = "test_" + name_ + ".lua";
        for (const std::string& file : {scene, test})
            if (std::error_code none; fs::exists(fs::symlink_status(file, none)))
                throw Error("exists already and is not changed; choose another name").at({file, 0});

        const fs::path lua = Installation::find().value().lua;
        make(scene, fill_in(lua, "scene.lua", name_));
        make(test, fill_in(lua, "test.lua", name_));
        make(".luacheckrc", fill_in(lua, "luacheckrc", name_));
        JsonText editor(2);
        editor.object("runtime.version", "LuaJIT", "workspace.library", std::array{(lua / "rapid.d.lua").string()});
        make(".luarc.json", editor.text() + '\n');
        print(fmt::format("now: {0} run {1} -f 1-96 -o {2}.####.png\n     {0} test {3}\n", name_of_command(), scene,
                          name_, test));
        return status_done;
    }

private:
    void check_name() const
    {
        const bool word = !name_.empty() && (std::isalpha(static_cast<unsigned char>(name_[0])) || name_[0] == '_') &&
                          std::all_of(name_.begin(), name_.end(),
                                      [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
        if (!word)
            throw Error(
                fmt::format("rapid new: \"{}\" can't be the name of a scene; it must consist of letters, digits, _ "
                            "and -, and begin with a letter or _",
                            name_));
        const std::vector<SceneNodeType> types = SceneInside::all_node_types().value();
        if (std::any_of(types.begin(), types.end(), [&](const SceneNodeType& type) { return type.name == name_; }))
            throw Error(
                fmt::format("rapid new: \"{0}\" is the name of a node, and {0}.lua would hide it from the scenes "
                            "in this folder; choose another name",
                            name_));
    }

    // Existing files are kept: a second scene in a folder finds .luacheckrc and .luarc.json.
    static void make(const std::string& file, const std::string& text)
    {
        if (make_file(file, text)) print(fmt::format("made {}\n", file));
    }

    std::string name_;
};
RAPID_COMMAND(New);

}  // namespace
}  // namespace rapid

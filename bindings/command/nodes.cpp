// rapid nodes: documents the node types, native and Lua-authored, from their declarations.
#include <fmt/format.h>

#include <algorithm>

#include "bindings/command_line/command.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"

namespace rapid {
namespace {

std::string list_of(const std::vector<NodeDocument>& types)
{
    std::size_t width = 0;
    for (const NodeDocument& type : types) width = std::max(width, type.name.size());
    std::string text;
    for (const NodeDocument& type : types) text += fmt::format("{:{}}  {}\n", type.name, width, type.doc);
    return text;
}

class Nodes : public Command {
public:
    std::string name() const override { return "nodes"; }
    std::string doc() const override { return "lists the nodes, or documents one"; }

    void declare(Options& options) override
    {
        options.add_option("NAME", name_, "documents this node").type_name("");
        const Option json = options.add_flag("--json", json_, "as JSON");
        options
            .add_flag("--annotations", annotations_,
                      "as annotations for the Lua language server: the text of lua/rapid.d.lua")
            .excludes(json);
    }

    int run(const CommonOptions&) override
    {
        const NodeDocuments documents = SceneInside::documents().value();
        for (const std::string& warning : documents.warnings) print_warning(warning);
        if (annotations_) {
            if (!name_.empty()) throw Error("rapid nodes: --annotations describes all nodes; remove " + name_);
            print(documents.annotations);
        } else if (!name_.empty()) {
            const SceneReport& page = found_in(documents.types).page;
            print(json_ ? json_text(CheckedJson::parse(page.json), 2) + '\n' : page.text);
        } else if (json_) {
            JsonText json(2);
            json.begin_list();
            for (const NodeDocument& type : documents.types) json.value(CheckedJson::parse(type.page.json));
            json.end();
            print(json.text() + '\n');
        } else {
            print(list_of(documents.types));
        }
        return status_done;
    }

private:
    const NodeDocument& found_in(const std::vector<NodeDocument>& types) const
    {
        const auto found =
            std::find_if(types.begin(), types.end(), [&](const auto& type) { return type.name == name_; });
        if (found != types.end()) return *found;
        std::vector<std::string> names;
        for (const NodeDocument& type : types) names.push_back(type.name);
        const std::string nearest = did_you_mean(name_, names);
        throw Error(
            fmt::format("unknown node \"{}\"{}", name_, nearest.empty() ? "; `rapid nodes` lists all nodes" : nearest));
    }

    std::string name_;
    bool json_ = false, annotations_ = false;
};
RAPID_COMMAND(Nodes);

}  // namespace
}  // namespace rapid

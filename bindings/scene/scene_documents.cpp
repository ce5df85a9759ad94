// Functions that need no scene: documentation of node types, and spare memory.
#include <fmt/format.h>

#include <utility>

#include "bindings/host/annotations.h"
#include "bindings/host/node_page.h"
#include "bindings/scene/scene_error.h"
#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "runtime/graph/plugin.h"
#include "runtime/points/buffer.h"

namespace rapid {
namespace {

Result<Done> loaded(const std::string& from, void (*load)(const std::string&))
{
    try {
        load(from);
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace

Result<Done> Scene::load_plugin(const std::string& file) { return loaded(file, rapid::load_plugin); }
Result<Done> SceneInside::load_plugins(const std::string& path) { return loaded(path, rapid::load_plugins); }

Result<Done> SceneInside::keep_spare_columns(std::size_t columns)
{
    try {
        constexpr std::size_t most = 4096;  // each release iterates over them
        if (columns > most) refuse(fmt::format("{} columns should be kept; at most {} are possible", columns, most));
        SparePages::all().keep(columns);
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<NodeDocuments> SceneInside::documents()
{
    try {
        NodeTypes all = with_own_nodes();
        NodeDocuments result;
        for (const NodeType* type : all.registry.types())
            result.types.push_back({type->name, type->doc, {page_of(*type), json_of(*type)}});
        result.warnings = std::move(all.faults);
        result.annotations = annotations_of(all.registry);
        return result;
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

}  // namespace rapid

// What scenes are made of, without a scene.
#include <utility>

#include "bindings/host/annotations.h"
#include "bindings/host/node_page.h"
#include "bindings/host/own_nodes.h"
#include "bindings/scene/scene_error.h"
#include "include/rapid/scene.h"

namespace rapid {

Result<NodeDocuments> Scene::documents()
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
        return caught_error(SceneError::Unexpected);
    }
}

}  // namespace rapid

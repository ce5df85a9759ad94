// Finds Rapid's own files.
#include "bindings/scene/installation.h"

#include "bindings/host/modules.h"
#include "bindings/scene/scene_error.h"
#include "runtime/base/deferred.h"
#include "runtime/base/library_folder.h"

namespace rapid {

Result<Installation> Installation::find()
{
    try {
        return Installation{lua_folder().string(), library_folder().string()};
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

Result<Done> Installation::load_all()
{
    try {
        load_deferred();
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

}  // namespace rapid

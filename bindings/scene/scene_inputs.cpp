// The inputs that determine a scene's frames, and the contents of the files that it reads.
#include <algorithm>

#include "bindings/scene/scene_impl.h"

namespace rapid {

void Scene::Impl::require_keep_state() const
{
    if (!inputs) refuse("the scene does not record what it reads; open it with SceneHooks::keep_state");
}

Result<SceneFingerprint> SceneInside::fingerprint(Scene& scene)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::WrongCall, [&] {
        impl.require_keep_state();
        SceneFingerprint result;
        result.parts = fingerprint_of(*impl.session, *impl.plan, impl.file, impl.opened);
        if (impl.hooks.per_point_diagnostics)
            result.parts["points tell"] = impl.options.estimate_errors ? "error, substeps, asleep" : "substeps, asleep";
        result.hash = hash_of(result.parts);
        return result;
    });
}

Result<std::map<std::string, std::string>> SceneInside::take_inputs(Scene& scene)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::WrongCall, [&] {
        impl.require_keep_state();
        return impl.inputs->take();
    });
}

Result<bool> SceneInside::are_unchanged(Scene& scene, const std::map<std::string, std::string>& inputs)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::WrongCall, [&] {
        impl.require_keep_state();
        return std::all_of(inputs.begin(), inputs.end(), [&](const auto& one) {
            return InputContents::is_content(one.first) && impl.inputs->content_of(one.first) == one.second;
        });
    });
}

}  // namespace rapid

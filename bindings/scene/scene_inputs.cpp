// What the frames of a scene follow from, and the contents of the files that it reads.
#include <algorithm>

#include "bindings/scene/scene_impl.h"

namespace rapid {

void Scene::Impl::refuse_unless_kept() const
{
    if (!inputs) refuse("nothing is kept of what the scene reads; open it with SceneHooks::keep_state");
}

Result<SceneFingerprint> Scene::fingerprint()
{
    return impl_->call(SceneError::WrongCall, [&] {
        impl_->refuse_unless_kept();
        SceneFingerprint result;
        result.parts = fingerprint_of(*impl_->session, *impl_->plan, impl_->file, impl_->opened);
        if (impl_->hooks.tell_points)
            result.parts["points tell"] =
                impl_->options.estimate_errors ? "error, substeps, asleep" : "substeps, asleep";
        result.hash = hash_of(result.parts);
        return result;
    });
}

Result<std::map<std::string, std::string>> Scene::take_inputs()
{
    return impl_->call(SceneError::WrongCall, [&] {
        impl_->refuse_unless_kept();
        return impl_->inputs->take();
    });
}

Result<bool> Scene::are_unchanged(const std::map<std::string, std::string>& inputs)
{
    return impl_->call(SceneError::WrongCall, [&] {
        impl_->refuse_unless_kept();
        return std::all_of(inputs.begin(), inputs.end(), [&](const auto& one) {
            return InputContents::is_content(one.first) && impl_->inputs->content_of(one.first) == one.second;
        });
    });
}

}  // namespace rapid

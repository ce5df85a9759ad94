// Scenes: a session, a plan and an evaluator behind an interface without exceptions.
#include "include/rapid/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bindings/scene/host_object.h"
#include "bindings/scene/scene_impl.h"

namespace rapid {
namespace {

SceneNodeType described(const NodeType& type)
{
    SceneNodeType result{type.name, type.doc, {}};
    for (const Param& param : type.params) {
        if (param.internal) continue;
        const std::string fallback = param.fallback.is_nil() ? "" : describe(param.fallback);
        result.parameters.push_back({param.name, param.type, param.unit, param.doc, fallback, param.required});
    }
    return result;
}

void add_types(std::map<std::string, SceneNodeType>& by_name, const Registry& registry)
{
    for (const NodeType* type : registry.types()) by_name[type->name] = described(*type);
}

std::vector<SceneNodeType> in_order(std::map<std::string, SceneNodeType> by_name)
{
    std::vector<SceneNodeType> types;
    for (auto& [name, type] : by_name) types.push_back(std::move(type));
    return types;
}

}  // namespace

Scene::Scene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

namespace {

// Opens a file, or a text with its name, with hooks.
Result<std::unique_ptr<SceneInside::Impl>> opened(const std::string& file, std::optional<std::string> text,
                                                  SceneOptions options, SceneHooks hooks)
{
    if (std::optional<SceneError> fault = fault_of(options)) return std::move(*fault);
    try {
        auto impl = std::make_unique<SceneInside::Impl>();
        impl->file = file;
        impl->text = std::move(text);
        impl->options = std::move(options);
        impl->hooks = std::move(hooks);
        impl->keeps_inputs = impl->hooks.keep_state;
        if (impl->options.threads > 0) impl->arena.emplace(impl->options.threads);
        std::map<std::string, std::string> set;
        for (const auto& [name, value] : impl->options.set) set[name] = text_of(value);
        const Result<Done> loaded = impl->call(SceneError::WrongScene, [&] {
            impl->take_offers();
            impl->load(std::move(set));
            return Done();
        });
        if (!loaded) return loaded.error();
        return impl;
    } catch (...) {
        return caught_error(SceneError::Unexpected);
    }
}

}  // namespace

Result<Scene> Scene::open(const std::string& file, SceneOptions options)
{
    return SceneInside::open(file, std::move(options), {});
}

Result<Scene> Scene::open_text(const std::string& name, const std::string& text, SceneOptions options)
{
    if (name.empty()) return wrong_call("the scene has no name; give one for messages, such as scene.lua");
    auto impl = opened(name, text, std::move(options), {});
    if (!impl) return impl.error();
    return Scene(std::move(*impl));
}

Result<Scene> SceneInside::open(const std::string& file, SceneOptions options, SceneHooks hooks)
{
    if (file.empty()) return wrong_call("no file is given; give the path of a scene, such as graphs/first.lua");
    auto impl = opened(file, std::nullopt, std::move(options), std::move(hooks));
    if (!impl) return impl.error();
    return Scene(std::move(*impl));
}

const std::vector<SceneParameter>& Scene::parameters() const { return impl_->parameters; }
const std::vector<SceneNode>& Scene::nodes() const { return impl_->nodes; }
const std::vector<SceneOutput>& SceneInside::outputs(const Scene& scene) { return of(scene).outputs; }
double Scene::fps() const { return impl_->plan->simulations.front().fps; }
const std::vector<std::string>& Scene::warnings() const { return impl_->warnings; }
std::int64_t Scene::first_frame() const { return impl_->plan->first_frame(); }
std::int64_t Scene::next_frame() const { return impl_->next; }

Result<std::vector<SceneNodeType>> Scene::node_types()
{
    return impl_->call(SceneError::WrongScene, [&] {
        std::map<std::string, SceneNodeType> by_name;
        add_types(by_name, Session::all_node_types());
        add_types(by_name, impl_->session->registry());
        return in_order(std::move(by_name));
    });
}

Result<std::vector<SceneNodeType>> SceneInside::all_node_types()
{
    try {
        std::map<std::string, SceneNodeType> by_name;
        add_types(by_name, Session::all_node_types());
        return in_order(std::move(by_name));
    } catch (...) {
        return caught_error(SceneError::WrongScene);
    }
}

Result<Done> Scene::set(const std::string& name, SceneValue value) { return set({{name, std::move(value)}}); }

Result<Done> Scene::set(const std::vector<std::pair<std::string, SceneValue>>& values)
{
    return impl_->call(SceneError::WrongCall, [&] {
        auto set = impl_->settings;
        for (const auto& [name, value] : values) set[name] = text_of(value);
        impl_->load(std::move(set));
        impl_->cancellation.forget();
        return Done();
    });
}

Result<Done> Scene::offer(const std::string& name, const HostObject& object)
{
    return impl_->call(SceneError::WrongCall, [&] {
        const ObjectPtr made = make_object(name, object, impl_->options.guard_callbacks);
        impl_->offers->objects[name] = made;
        impl_->offered_meshes.offer(name, made, impl_->next);
        impl_->node_results_frame.reset();  // its functions may change it
        return Done();
    });
}

Result<SceneFrame> Scene::advance()
{
    return impl_->call(SceneError::FailedFrame, [&] {
        impl_->refuse_unless_ready();
        return impl_->advance();
    });
}

Result<SceneFrame> Scene::advance_to(std::int64_t frame)
{
    return impl_->call(SceneError::FailedFrame, [&] {
        impl_->refuse_unless_ready();
        if (frame < impl_->next)
            refuse(fmt::format("frame {} {}; the next frame is {}; call restart() or restore() to go back", frame,
                               frame < first_frame() ? "is before the scene's first" : "has been computed",
                               impl_->next));
        for (;;) {
            const bool last = impl_->next == frame;
            SceneFrame result = impl_->advance();
            const auto& progress = impl_->options.progress;
            if (progress && !call_program("progress", progress, result.number(), frame)) impl_->cancellation.request();
            impl_->cancellation.check();
            if (last) return result;
        }
    });
}

Result<Done> Scene::restart()
{
    return impl_->call(SceneError::WrongScene, [&] { return impl_->start_again(), Done(); });
}

Result<SceneSnapshot> Scene::save()
{
    return impl_->call(SceneError::FailedFrame, [&] {
        impl_->refuse_unless_ready();
        if (!impl_->has_advanced) refuse("no frame has been computed; call advance() first");
        auto data = std::make_shared<SceneSnapshot::Data>();
        data->snapshot = impl_->evaluator->save();
        data->meshes = impl_->offered_meshes.save();
        data->file = impl_->file;
        data->nodes = impl_->hash_of_nodes();
        return SceneSnapshot(std::move(data));
    });
}

Result<Done> Scene::restore(const SceneSnapshot& snapshot)
{
    return impl_->call(SceneError::WrongCall, [&] {
        impl_->refuse_unless_of_this_graph(snapshot);
        impl_->start_again();
        try {
            impl_->evaluator->load(snapshot.data_->snapshot);
        } catch (...) {
            impl_->evaluator.reset();
            throw;
        }
        impl_->offered_meshes.load(snapshot.data_->meshes);
        impl_->next = impl_->evaluator->next_frame();
        impl_->has_advanced = true;
        return Done();
    });
}

void Scene::cancel() { impl_->cancel(); }

}  // namespace rapid

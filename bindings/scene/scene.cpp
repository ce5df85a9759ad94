// Scenes: a session, a plan and an evaluator behind a face without exceptions.
#include "include/rapid/scene.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <utility>

#include "bindings/host/offers.h"
#include "bindings/host/picture_scene.h"
#include "bindings/host/session.h"
#include "bindings/scene/host_object.h"
#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_error.h"
#include "runtime/cancellation.h"
#include "runtime/memory_budget.h"
#include "runtime/memory_watch.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/png_file.h"

namespace rapid {
namespace {

// As --set takes it.
std::string text_of(const SceneValue& value)
{
    if (const auto* number = std::get_if<double>(&value)) return fmt::format("{}", *number);
    if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    const auto& [x, y, z] = std::get<std::array<double, 3>>(value);
    return fmt::format("{},{},{}", x, y, z);
}

SceneValue value_in_header(const Value& value)
{
    if (const auto* number = value.get<double>()) return *number;
    if (const auto* boolean = value.get<bool>()) return *boolean;
    if (const auto* vector = value.get<Vec3d>()) return std::array<double, 3>{(*vector)[0], (*vector)[1], (*vector)[2]};
    return *value.get<std::string>();
}

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

}  // namespace

// One scene. Its session is run again for other parameters; plan and evaluator for each start.
struct [[gnu::visibility("hidden")]] Scene::Impl
{
    std::string file;
    std::optional<std::string> text;
    SceneOptions options;
    std::map<std::string, std::string> settings;  // of parameters, by name
    std::shared_ptr<Offers> offers = std::make_shared<Offers>();

    std::unique_ptr<Session> session;
    std::vector<SceneParameter> parameters;
    std::vector<SceneNode> nodes;
    std::vector<std::string> warnings;
    std::unique_ptr<Plan> plan;
    std::unique_ptr<Evaluator> evaluator;  // null behind an error
    std::unique_ptr<SceneOfPlan> picture_scene;
    std::int64_t next = 1;
    bool has_advanced = false;

    std::optional<tbb::task_arena> arena;
    std::atomic<bool> is_busy = false;
    std::atomic<bool> is_late = false;  // a script has been stopped in this call

    // What cancel() may do while another thread is in a call.
    Cancellation cancellation;
    std::mutex scripts_mutex;
    Session* scripts = nullptr;  // that an advance runs now

    // Runs f, the whole of a call: in the scene's threads, with its limit of memory, its exceptions as errors.
    template <class F>
    auto call(SceneError::Kind kind, const F& f)->Result<decltype(f())>
    {
        if (is_busy.exchange(true)) return busy();
        struct Free {
            std::atomic<bool>& is_busy;
            ~Free() { is_busy = false; }
        } const free{is_busy};
        try {
            std::optional<decltype(f())> value;
            const auto run = [&] {
                const MemoryBudget budget(options.memory);
                if (session) session->use_from_this_thread();
                // Of the loops of this scene no thread that waits takes up another scene.
                tbb::this_task_arena::isolate([&] { value.emplace(f()); });
            };
            arena ? arena->execute(run) : run();
            return std::move(*value);
        } catch (...) {
            SceneError error = caught_error(is_late.exchange(false) ? SceneError::TooLong : kind);
            if (error.message.find(Cancellation::text) != std::string::npos) error.kind = SceneError::Cancelled;
            if (error.kind == SceneError::Cancelled || error.kind == SceneError::OutOfMemory) cancellation.forget();
            return error;
        }
    }

    SessionOptions session_options(const std::map<std::string, std::string>& set)
    {
        SessionOptions result;
        result.set = set;
        result.script_timeout = options.script_seconds;
        result.script_memory = options.script_memory;
        result.text = text;
        for (const std::string& path : options.paths) result.paths.emplace_back(path);
        result.interruptible = true;
        result.on_timeout = [this](const std::string&) { is_late = true; };
        result.offers = offers;
        result.quiet = !options.log;
        if (options.log)
            result.on_print = [log = options.log](const std::string& printed) {
                std::string line = printed;
                if (!line.empty() && line.back() == '\n') line.pop_back();
                call_program("log", log, LogLevel::Print, line);
            };
        if (options.find_module)
            result.find_module = [find = options.find_module](const std::string& name) {
                return call_program("find_module", find, name);
            };
        if (options.find_file)
            result.find_file = [find = options.find_file](const std::string& path) {
                return call_program("find_file", find, path);
            };
        return result;
    }

    void tell(const std::vector<std::string>& texts) const
    {
        if (!options.log) return;
        for (const std::string& line : texts) call_program("log", options.log, LogLevel::Warning, line);
    }

    void take_offers()
    {
        for (const auto& [name, object] : options.objects)
            offers->objects[name] = make_object(name, object, options.guard_callbacks);
        for (const HostNode& node : options.nodes)
            offers->node_types.push_back(make_type(node, options.guard_callbacks));
        options.objects.clear();
        options.nodes.clear();
    }

    // Runs the file with these settings. The scene is as it was where that fails.
    void load(std::map<std::string, std::string> set)
    {
        auto fresh = std::make_unique<Session>(file, session_options(set));
        auto fresh_plan = std::make_unique<Plan>(fresh->graph(), plan_options());
        std::vector<std::string> told = fresh->take_warnings();
        told.insert(told.end(), fresh_plan->warnings.begin(), fresh_plan->warnings.end());
        picture_scene.reset();
        evaluator.reset();
        plan.reset();
        session = std::move(fresh);
        settings = std::move(set);
        warnings = std::move(told);
        describe_scene();
        start(std::move(fresh_plan));
        tell(warnings);
    }

    PlanOptions plan_options() const
    {
        PlanOptions result;
        result.seed = options.seed;
        result.keep_all = options.keep_all;
        return result;
    }

    void describe_scene()
    {
        parameters.clear();
        for (const Session::Parameter& parameter : session->parameters())
            parameters.push_back(
                {parameter.name, parameter.doc, value_in_header(parameter.value), value_in_header(parameter.fallback)});
        nodes.clear();
        for (const NodePtr& node : session->graph().nodes)
            nodes.push_back({node->name, node->type->name, node->location.file, node->location.line});
    }

    // By which snapshots know their graph.
    std::vector<std::string> node_names() const
    {
        std::vector<std::string> names;
        for (const SceneNode& node : nodes) names.push_back(node.type + ' ' + node.name);
        return names;
    }

    // A new run of the graph: operators keep state, and belong to a plan.
    void start(std::unique_ptr<Plan> fresh)
    {
        evaluator.reset();
        picture_scene.reset();
        plan = std::move(fresh);
        evaluator = std::make_unique<Evaluator>(*plan);
        if (!options.estimate_errors) evaluator->leave_out_errors();
        next = plan->first_frame();
        has_advanced = false;
    }

    // Scripts that were stopped do not run again.
    void start_again()
    {
        cancellation.forget();
        if (session->interrupted() != Interruption::None) return load(settings);
        start(std::make_unique<Plan>(session->graph(), plan_options()));
    }

    SceneFrame advance()
    {
        const Scripts running(*this);
        const Cancellation::Scope scope(&cancellation);
        cancellation.check();
        const MemoryWatch watch(
            [this](const std::string& message) {
                cancellation.request(message);
                session->interrupt(message);
            },
            {});
        auto data = std::make_shared<SceneFrame::Data>();
        try {
            data->result = evaluator->advance();
        } catch (...) {
            evaluator.reset();
            throw;
        }
        data->warnings = session->take_warnings();
        data->warnings.insert(data->warnings.end(), data->result.warnings.begin(), data->result.warnings.end());
        data->scene = this;
        next = evaluator->next_frame();
        has_advanced = true;
        tell(data->warnings);
        const auto& outputs = data->result.outputs;
        const std::string output = outputs.count("main") ? "main" : outputs.begin()->first;
        return SceneFrame(std::move(data), output);
    }

    // For as long as it lives, cancel() stops scripts.
    struct Scripts {
        Impl& impl;
        explicit Scripts(Impl& of) : impl(of) { set(impl.session.get()); }
        ~Scripts() { set(nullptr); }
        void set(Session* to)
        {
            const std::lock_guard lock(impl.scripts_mutex);
            impl.scripts = to;
        }
    };

    void refuse_unless_ready() const
    {
        if (!evaluator) refuse("the scene's last frame failed; call restart(), restore() or set() first");
    }
};

namespace {

std::optional<SceneError> fault_of(const SceneOptions& options)
{
    constexpr int most_threads = 4096;  // a typing error, not a machine
    if (options.threads < 0 || options.threads > most_threads)
        return wrong_call(fmt::format("threads = {}; it must be from 0 to {}", options.threads, most_threads));
    if (!(options.script_seconds > 0))
        return wrong_call(fmt::format("script_seconds = {}; it must be above 0", options.script_seconds));
    if (options.script_memory == 0) return wrong_call("script_memory = 0; it must be bytes above 0");
    return std::nullopt;
}

}  // namespace

Scene::Scene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

Result<Scene> Scene::open(const std::string& file, SceneOptions options)
{
    if (file.empty()) return wrong_call("no file is named; give the path of a scene, such as graphs/first.lua");
    return open_any(file, std::nullopt, std::move(options));
}

Result<Scene> Scene::open_text(const std::string& name, const std::string& text, SceneOptions options)
{
    if (name.empty()) return wrong_call("the scene has no name; give one for its messages, such as scene.lua");
    return open_any(name, text, std::move(options));
}

Result<Scene> Scene::open_any(const std::string& file, std::optional<std::string> text, SceneOptions options)
{
    if (std::optional<SceneError> fault = fault_of(options)) return std::move(*fault);
    try {
        auto impl = std::make_unique<Impl>();
        impl->file = file;
        impl->text = std::move(text);
        impl->options = std::move(options);
        if (impl->options.threads > 0) impl->arena.emplace(impl->options.threads);
        std::map<std::string, std::string> set;
        for (const auto& [name, value] : impl->options.set) set[name] = text_of(value);
        const Result<Done> loaded = impl->call(SceneError::WrongScene, [&] {
            impl->take_offers();
            impl->load(std::move(set));
            return Done();
        });
        if (!loaded) return loaded.error();
        return Scene(std::move(impl));
    } catch (...) {
        return caught_error(SceneError::Unexpected);
    }
}

const std::vector<SceneParameter>& Scene::parameters() const { return impl_->parameters; }
const std::vector<SceneNode>& Scene::nodes() const { return impl_->nodes; }
const std::vector<std::string>& Scene::warnings() const { return impl_->warnings; }
std::int64_t Scene::first_frame() const { return impl_->plan->first_frame(); }
std::int64_t Scene::next_frame() const { return impl_->next; }

Result<std::vector<SceneNodeType>> Scene::node_types()
{
    return impl_->call(SceneError::WrongScene, [&] {
        const Registry shipped = Session::all_node_types();
        std::map<std::string, SceneNodeType> by_name;
        for (const NodeType* type : shipped.types()) by_name[type->name] = described(*type);
        for (const NodeType* type : impl_->session->registry().types()) by_name[type->name] = described(*type);
        std::vector<SceneNodeType> types;
        for (auto& [name, type] : by_name) types.push_back(std::move(type));
        return types;
    });
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
        impl_->offers->objects[name] = make_object(name, object, impl_->options.guard_callbacks);
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
            refuse(fmt::format("frame {} {}; the next one is {}: restart() or restore() to go back", frame,
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
        if (!impl_->has_advanced) refuse("no frame has been computed; advance() first");
        auto data = std::make_shared<SceneSnapshot::Data>();
        data->snapshot = impl_->evaluator->save();
        data->nodes = impl_->node_names();
        return SceneSnapshot(std::move(data));
    });
}

Result<Done> Scene::restore(const SceneSnapshot& snapshot)
{
    return impl_->call(SceneError::WrongCall, [&] {
        if (snapshot.data_->nodes != impl_->node_names())
            refuse("the snapshot is of another graph; restore it in a scene with the same nodes");
        impl_->start_again();
        try {
            impl_->evaluator->load(snapshot.data_->snapshot);
        } catch (...) {
            impl_->evaluator.reset();
            throw;
        }
        impl_->next = impl_->evaluator->next_frame();
        impl_->has_advanced = true;
        return Done();
    });
}

void Scene::cancel()
{
    impl_->cancellation.request();
    const std::lock_guard lock(impl_->scripts_mutex);
    if (impl_->scripts) impl_->scripts->interrupt(Cancellation::text);
}

Result<std::string> Scene::picture(const SceneFrame& frame, PictureSize size)
{
    return impl_->call(SceneError::WrongCall, [&] {
        const SceneFrame::Data& data = *frame.data_;
        if (data.scene != impl_.get()) refuse("the frame is of another scene");
        if (!impl_->picture_scene) impl_->picture_scene = std::make_unique<SceneOfPlan>(*impl_->plan);
        PictureOptions options;
        options.width = size.width;
        options.height = size.height;
        FrameInfo info;
        info.number = static_cast<int>(frame.number());
        info.time = frame.time();
        info.fps = frame.fps();
        info.picture = std::make_shared<PictureOptions>(options);
        info.scene = impl_->picture_scene->at(frame.number());
        return encode_png(picture_of(data.result.outputs.at(frame.output_), info));
    });
}

}  // namespace rapid

#include "bindings/scene/scene_impl.h"

#include <fmt/format.h>

#include "bindings/scene/host_object.h"
#include "runtime/files/content_hash.h"

namespace rapid {

namespace {

// Returns a parameter's value: a boolean, a number, a text or three numbers.
SceneValue value_in_header(const Value& value)
{
    if (const auto* number = value.get<double>()) return *number;
    if (const auto* boolean = value.get<bool>()) return *boolean;
    if (const auto* vector = value.get<Vec3d>()) return std::array<double, 3>{(*vector)[0], (*vector)[1], (*vector)[2]};
    return *value.get<std::string>();
}

std::vector<SceneParameter> parameters_of(const Session& session)
{
    std::vector<SceneParameter> parameters;
    for (const Session::Parameter& parameter : session.parameters())
        parameters.push_back(
            {parameter.name, parameter.doc, value_in_header(parameter.value), value_in_header(parameter.fallback)});
    return parameters;
}

}  // namespace

std::string text_of(const SceneValue& value)
{
    if (const auto* number = std::get_if<double>(&value)) return fmt::format("{}", *number);
    if (const auto* boolean = std::get_if<bool>(&value)) return *boolean ? "true" : "false";
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    const auto& [x, y, z] = std::get<std::array<double, 3>>(value);
    return fmt::format("{},{},{}", x, y, z);
}

std::optional<SceneError> fault_of(const SceneOptions& options)
{
    if (options.threads < 0 || options.threads > max_threads)
        return wrong_call(fmt::format("threads = {}; it must be from 0 to {}", options.threads, max_threads));
    if (!(options.script_seconds > 0))
        return wrong_call(fmt::format("script_seconds = {}; it must be above 0", options.script_seconds));
    if (options.script_memory == 0) return wrong_call("script_memory = 0; it must be above 0");
    return std::nullopt;
}

SceneError Scene::Impl::error_of_call(SceneError::Kind fault)
{
    SceneError error = caught_error(fault);
    if (error.kind == SceneError::Cancelled || error.kind == SceneError::OutOfMemory) cancellation.forget();
    return error;
}

SessionOptions Scene::Impl::session_options(const std::map<std::string, std::string>& set,
                                            std::shared_ptr<InputContents> read)
{
    SessionOptions result;
    result.set = set;
    result.script_timeout = options.script_seconds;
    result.script_memory = options.script_memory;
    result.text = text;
    for (const std::string& path : options.paths) result.paths.emplace_back(path);
    result.may_write = may_write;
    result.interruptible = true;
    result.on_timeout = [this](const std::string& message) { call_hook(hooks.on_script_timeout, message); };
    if (hooks.on_file_read || read)
        result.on_read = [this, read = std::move(read)](const std::filesystem::path& path) {
            if (read) read->add(path);
            call_hook(hooks.on_file_read, path.string());
        };
    result.keeps_state = hooks.keep_state;
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

void Scene::Impl::log_warnings(const std::vector<std::string>& strings) const
{
    if (!options.log) return;
    for (const std::string& line : strings) call_program("log", options.log, LogLevel::Warning, line);
}

void Scene::Impl::take_offers()
{
    for (const auto& [name, object] : options.objects)
        offers->objects[name] = make_object(name, object, options.guard_callbacks);
    for (const HostNode& node : options.nodes) offers->node_types.push_back(make_type(node, options.guard_callbacks));
    options.objects.clear();
    options.nodes.clear();
}

void Scene::Impl::load(std::map<std::string, std::string> set)
{
    std::shared_ptr<InputContents> read;
    if (keeps_inputs)
        read =
            std::make_shared<InputContents>(std::filesystem::path(file).parent_path(), InputContents::Code::Excluded);
    SessionOptions session_with = session_options(set, read);
    session_with.interruption = std::make_shared<Interruption>();
    Cancellation opening;
    const Cancellation::Scope scope(hooks.stop.stop_possible() ? &opening : Cancellation::current());
    const std::stop_callback stop(hooks.stop, [&opening, scripts = session_with.interruption]() noexcept {
        try {
            opening.request();
            scripts->request(Cancellation::cancelled());
        } catch (...) {  // out of memory
        }
    });
    auto fresh = std::make_unique<Session>(file, std::move(session_with));
    if (hooks.parameters) call_hook(hooks.parameters, parameters_of(*fresh));
    std::vector<std::string> fresh_warnings = fresh->take_warnings();
    log_warnings(fresh_warnings);  // the plan may fail for the reason that they warn of
    auto fresh_plan = std::make_unique<Plan>(fresh->graph(), plan_options());
    log_warnings(fresh_plan->warnings);
    fresh_warnings.insert(fresh_warnings.end(), fresh_plan->warnings.begin(), fresh_plan->warnings.end());
    picture_scene.reset();
    evaluator.reset();
    plan.reset();
    session = std::move(fresh);
    settings = std::move(set);
    warnings = std::move(fresh_warnings);
    inputs = std::move(read);
    opened = inputs ? inputs->take() : Fingerprint();
    node_results.clear();
    node_results_frame.reset();
    describe_scene(*fresh_plan);
    start(std::move(fresh_plan));
}

PlanOptions Scene::Impl::plan_options() const
{
    PlanOptions result = plan_of_run;
    result.seed = options.seed;
    result.keep_all = options.keep_all;
    return result;
}

void Scene::Impl::describe_scene(const Plan& planned)
{
    parameters = parameters_of(*session);
    nodes.clear();
    for (const NodePtr& node : session->graph().nodes)
        nodes.push_back({node->name, node->type->name, node->location.file, node->location.line});
    outputs.clear();
    for (const auto& [name, node] : planned.outputs) {
        SceneOutput& output = outputs.emplace_back();
        output.name = name;
        for (const std::size_t simulation : planned.nodes[node].carries)
            output.creates.push_back(planned.simulations[simulation].create->name);
    }
}

std::string Scene::Impl::hash_of_nodes() const
{
    std::string all;
    for (const SceneNode& node : nodes) all += fmt::format("{} {}\n", node.type, node.name);
    return hash_text(content_hash(all));
}

void Scene::Impl::start(std::unique_ptr<Plan> fresh)
{
    evaluator.reset();
    picture_scene.reset();
    plan = std::move(fresh);
    evaluator = std::make_unique<Evaluator>(*plan, write);
    ended_by = nullptr;
    if (!options.estimate_errors) evaluator->disable_error_estimates();
    if (hooks.per_point_diagnostics) evaluator->add_per_point_diagnostics();
    errors = std::make_shared<ErrorSources>(error_sources_of(*plan));
    next = plan->first_frame();
    has_advanced = false;
    offered_meshes.start(next);
}

void Scene::Impl::start_again()
{
    cancellation.forget();
    if (session->is_interrupted()) return load(settings);
    start(std::make_unique<Plan>(session->graph(), plan_options()));
}

SceneFrame Scene::Impl::advance()
{
    const Running running(*this);
    auto data = std::make_shared<SceneFrame::Data>();
    try {
        data->result = evaluator->advance();
    } catch (...) {
        evaluator.reset();
        throw;
    }
    data->errors = errors;
    data->warnings = offered_meshes.take_warnings();
    const std::vector<std::string> of_scripts = session->take_warnings();
    data->warnings.insert(data->warnings.end(), of_scripts.begin(), of_scripts.end());
    data->warnings.insert(data->warnings.end(), data->result.warnings.begin(), data->result.warnings.end());
    data->scene = number;
    next = evaluator->next_frame();
    has_advanced = true;
    log_warnings(data->warnings);
    const std::string output = data->first_output();
    return SceneFrame(std::move(data), output);
}

std::uint64_t Scene::Impl::next_number()
{
    static std::atomic<std::uint64_t> last = 0;
    return ++last;
}

void Scene::Impl::cancel() noexcept
{
    try {
        cancellation.request();
        const std::lock_guard lock(scripts_mutex);
        if (scripts) scripts->interrupt(Cancellation::cancelled());
    } catch (...) {
    }
}

Scene::Impl::SeparateCall::SeparateCall(Impl& impl, const std::shared_ptr<Interruption>& scripts)
    : scope(&impl.cancellation), stop(impl.hooks.stop, [&impl, scripts] {
          try {
              impl.cancellation.request();
              scripts->request(Cancellation::cancelled());
          } catch (...) {  // out of memory
          }
      })
{
    if (impl.hooks.watch_memory)
        watch.emplace(
            impl.memory_at_first,
            [&impl, scripts](const Error& error) {
                impl.cancellation.request(error);
                scripts->request(error);
            },
            impl.memory_overrun_callback());
    impl.cancellation.check();
}

MemoryWatch::Callback Scene::Impl::memory_overrun_callback() const
{
    if (!hooks.on_memory_exceeded) return {};
    return [this](const Error& error) {
        call_hook(hooks.on_memory_exceeded, cancellation.placed(error).at({file, 0}).what());
    };
}

void Scene::Impl::refuse_unless_ready() const
{
    if (!evaluator && ended_by) std::rethrow_exception(ended_by);
    if (!evaluator) refuse("the scene's last frame failed; call restart(), restore() or set() first");
}

void Scene::Impl::refuse_unless_of_this_graph(const SceneSnapshot& snapshot) const
{
    if (snapshot.data_->nodes != hash_of_nodes())
        refuse("the snapshot belongs to another graph; restore it in a scene with the same nodes");
}

}  // namespace rapid

#include "bindings/host/script_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <lua.hpp>

#include "bindings/host/graph_parameter.h"
#include "bindings/host/kernel_analysis.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/session.h"
#include "bindings/host/values.h"
#include "runtime/base/setting_names.h"
#include "runtime/graph/override.h"

namespace rapid {

// Returns the watchdog's callback. An interruptible script is stopped, and the process continues.
Watchdog::OnTimeout ScriptHost::timeout_callback(const SessionOptions& options)
{
    if (options.interruptible)
        return [this, callback = options.on_timeout](const std::string& message) {
            if (callback) callback(message);
            interruption.request(Error(message, ErrorKind::TooLong));
            return Watchdog::Continue;
        };
    return [callback = options.on_timeout](const std::string& message) {
        if (callback) callback(message);
        return Watchdog::EndProcess;
    };
}

ScriptHost::ScriptHost(const std::filesystem::path& file, SessionOptions options)
    : shared_interruption(options.interruption ? options.interruption : std::make_shared<Interruption>()),
      interruption(*shared_interruption),
      watchdog(options.script_timeout, timeout_callback(options)),
      modules({file, options.on_read, options.paths, options.find_module}),
      file_(file),
      options_(std::move(options)),
      main_thread_(std::this_thread::get_id())
{
    if (options_.offers)
        for (const NodeType& type : options_.offers->node_types) registry.add(type);
    main_ = std::make_unique<State>(*this, true);
    if (!file.empty()) run_graph();
}

std::string ScriptHost::read_graph() const
{
    if (options_.on_read) options_.on_read(file_);
    std::error_code ignored;
    if (std::filesystem::is_directory(file_, ignored))
        throw Error("is a folder; give a graph file").at({file_.string(), 0});
    std::optional<std::string> text = read_lua_file(file_);
    if (!text) throw Error(std::strerror(errno)).at({file_.string(), 0});
    return std::move(*text);
}

void ScriptHost::run_graph()
{
    text_ = options_.text ? *options_.text : read_graph();
    graph.file = shown(file_);

    {
        const Watchdog::Section section(watchdog, fmt::format("{}: the graph's body", graph.file));
        run_file(*main_, 1);
    }
    if (options_.knobs && options_.knobs->empty())
        lua_pop(main_->lua(), 1);  // a study of which only the description was requested: it made no scene
    else
        collect_outputs(*main_);
    // A function that makes several chains gives all of them kernels of the same name.
    graph = with_unique_names(graph, [](const Node& node) {
        const Param* kernel = node.type->find("kernel");
        return kernel && !kernel->internal;
    });
    apply_arguments();

    const Watchdog::Section section(watchdog, fmt::format("{}: reading the kernels' bytecode", graph.file));
    analyse_kernels();
    refuse_memory();
    main_->set_loaded();
}

namespace {

// Throws Error if the name must not replace {output} in a file name.
void check_output_name(const std::string& name, const std::string& file)
{
    constexpr std::size_t most = 200;  // bytes; a file name has at most 255
    const bool plain =
        std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f || c == '/'; });
    if (name.empty() || name.size() > most || name.front() == '.' || !plain)
        throw Error(fmt::format("the graph returns an output \"{}\"; the name becomes part of file names, so it must "
                                "have 1 to {} bytes, no / and no control characters, and must not begin with a dot",
                                name, most))
            .at({file, 0});
}

}  // namespace

// Applies --set NODE.PARAM=VALUE to nodes; a rapid.param already has its value. Throws Error if the graph has no
// such parameter or node.
void ScriptHost::apply_arguments()
{
    std::vector<std::string> names;
    for (const Session::Parameter& parameter : parameters) names.push_back(parameter.name);
    std::map<std::string, Value> arguments;
    for (const auto& [name, value] : options_.set) {
        if (std::find(names.begin(), names.end(), name) != names.end()) continue;
        if (name.find('.') == std::string::npos)
            throw Error(fmt::format("{} {}={}: the graph has no parameter \"{}\"{}", name_of(Setting::Value), name,
                                    value, name, did_you_mean(name, names)))
                .at({graph.file, 0});
        constexpr std::string_view offered = "host:";  // prefix, in a program's scene, for an object of rapid.host
        arguments.emplace(name, options_.offers && value.starts_with(offered)
                                    ? Value(options_.offers->object(value.substr(offered.size())))
                                    : read_argument(value));
    }
    if (arguments.empty()) return;
    try {
        graph = with_arguments(graph, arguments);
    } catch (const Error& error) {
        if (!error.node().empty()) throw;
        throw Error(fmt::format("{} {}", name_of(Setting::Value), error.what()), error.kind()).at({graph.file, 0});
    }
}

void ScriptHost::analyse_kernels()
{
    for (const std::shared_ptr<Kernel>& kernel : kernels) {
        try {
            kernel->analyse();
        } catch (Error& error) {
            for (const NodePtr& node : graph.nodes)
                for (const auto& [name, argument] : node->arguments)
                    if (const auto* object = argument.get<ObjectPtr>(); object && *object == kernel)
                        error.in_node(node->name).at(node->location);
            throw;
        }
    }
}

// Throws Error if a function of the frame stores something between calls.
void ScriptHost::refuse_memory() const
{
    for (const std::shared_ptr<const FrameFunction>& function : frame_functions) {
        try {
            rapid::refuse_memory(*function);
        } catch (Error& error) {
            for (const NodePtr& node : graph.nodes)
                for (const auto& [name, argument] : node->arguments)
                    if (argument.function() == function.get()) error.in_node(node->name);
            throw;
        }
    }
}

// Leaves the first `results` values that the file returned on the stack.
void ScriptHost::run_file(State& state, int results)
{
    lua_State* L = state.lua();
    state.push_entry("run");
    push_text(L, text_);
    push_text(L, "@" + graph.file);
    if (options_.knobs)
        push(state, *options_.knobs);
    else
        lua_pushnil(L);
    try {
        state.call(3, results);
    } catch (Error& error) {
        error.at({graph.file, 0});  // if no line is known: stack overflow or out of memory
        throw;
    }
}

void ScriptHost::collect_outputs(State& state)
{
    lua_State* L = state.lua();
    const auto node_at_top = [&] {
        const auto handle = std::dynamic_pointer_cast<const NodeHandle>(to_object(state, -1));
        return handle ? handle->node : nullptr;
    };
    if (const NodePtr node = node_at_top()) {
        graph.outputs["main"] = node;
    } else if (lua_istable(L, -1)) {
        lua_pushnil(L);
        while (lua_next(L, -2)) {
            const NodePtr output = node_at_top();
            if (lua_type(L, -2) != LUA_TSTRING || !output)
                throw Error(
                    "the graph returns a table that contains other things than nodes by name; return { main = node, "
                    "... }")
                    .at({graph.file, 0});
            const std::string name = text_at(L, -2);
            check_output_name(name, graph.file);
            graph.outputs[name] = output;
            lua_pop(L, 1);
        }
    } else if (!lua_isnil(L, -1)) {
        throw Error(fmt::format("the graph returns {}; it must return a node, or a table of nodes by name",
                                describe(to_value(state, -1))))
            .at({graph.file, 0});
    }
    lua_pop(L, 1);
    if (graph.outputs.empty())
        throw Error("the graph returns no output; end the file with `return` and a node").at({graph.file, 0});
}

State& ScriptHost::local()
{
    if (std::this_thread::get_id() == main_thread_) return *main_;
    std::unique_ptr<State>& worker = workers_.local();
    if (!worker) worker = make_worker();
    return *worker;
}

State& ScriptHost::second()
{
    if (!second_) second_ = make_worker();
    return *second_;
}

KernelOrder::Sequence ScriptHost::sequence_of(const std::string& node) const
{
    const KernelOrder& order = options_.kernel_order;
    return order.node.empty() || order.node == node ? order.sequence : KernelOrder::Forward;
}

std::unique_ptr<State> ScriptHost::make_worker()
{
    auto state = std::make_unique<State>(*this, false);
    run_file(*state, 0);
    if (state->kernel_count() != kernels.size())
        throw Error(
            fmt::format(
                "the graph file made {} kernels in the first run and {} in a worker; it must do the same each time",
                kernels.size(), state->kernel_count()))
            .at({graph.file, 0});
    check_kernels(*state);
    state->set_loaded();
    return state;
}

// Matches kernels by their number and their bytecode.
void ScriptHost::check_kernels(State& worker) const
{
    for (const std::shared_ptr<Kernel>& kernel : kernels)
        if (kernel->fingerprint != fingerprint_of(worker, kernel->source.number))
            throw Error("the kernel differs when the graph file runs again; the file must do the same each time")
                .at(kernel->source.location);
}

void ScriptHost::load_shipped_nodes()
{
    for (const std::string& name : shipped_nodes()) {
        main_->push_entry("load_node");
        push_text(main_->lua(), name);
        main_->call(1, 0);
    }
}

}  // namespace rapid

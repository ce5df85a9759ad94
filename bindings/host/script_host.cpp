#include "bindings/host/script_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <lua.hpp>
#include <sstream>

#include "bindings/host/natives.h"

namespace rapid {
namespace {

std::optional<std::string> read_text(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path)) return std::nullopt;
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

// `graphs/sparks.lua` stays as the user typed it; a module beside it is shown the same way.
std::string shown(const std::filesystem::path& path) { return path.lexically_normal().string(); }

std::vector<std::filesystem::path> rapid_path()
{
    std::vector<std::filesystem::path> folders;
    const char* variable = std::getenv("RAPID_PATH");
    const std::string list = variable ? variable : "";
    for (std::size_t begin = 0; begin < list.size();) {
        const std::size_t end = std::min(list.find(':', begin), list.size());
        if (end > begin) folders.emplace_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return folders;
}

}  // namespace

std::filesystem::path lua_folder()
{
    static const std::filesystem::path folder = [] {
        std::error_code ignored;
        const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", ignored);
        const std::filesystem::path installed = program.parent_path().parent_path() / "share/rapid/lua";
        return std::filesystem::exists(installed / "host.lua", ignored) ? installed
                                                                        : std::filesystem::path(RAPID_SOURCE_LUA_DIR);
    }();
    return folder;
}

ScriptHost::ScriptHost(SessionOptions options) : options_(std::move(options)), main_thread_(std::this_thread::get_id())
{
    main_ = std::make_unique<State>(*this, true);
    watchdog_ = std::thread([this] { watch(); });
}

ScriptHost::ScriptHost(const std::filesystem::path& file, SessionOptions options) : ScriptHost(std::move(options))
{
    file_ = file;
    if (options_.on_read) options_.on_read(file);
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw Error("this is a folder; give a graph file").at({file.string(), 0});
    const std::optional<std::string> text = read_text(file);
    if (!text) throw Error(std::strerror(errno)).at({file.string(), 0});
    text_ = *text;
    graph.file = shown(file);

    {
        const Section section(*this, fmt::format("{}: the graph's body", graph.file));
        run_file(*main_, 1);
    }
    if (options_.knobs && options_.knobs->empty())
        lua_pop(main_->lua(), 1);  // a study that is only asked what it asks: no scene was made
    else
        collect_outputs(*main_);

    std::vector<std::string> names;
    for (const Session::Parameter& parameter : parameters) names.push_back(parameter.name);
    for (const auto& [name, value] : options_.set)
        if (std::find(names.begin(), names.end(), name) == names.end())
            throw Error(fmt::format("--set {}={}: the graph has no parameter \"{}\"{}", name, value, name,
                                    did_you_mean(name, names)))
                .at({graph.file, 0});

    const Section section(*this, fmt::format("{}: reading the kernels' bytecode", graph.file));
    for (const std::shared_ptr<Kernel>& kernel : kernels) {
        try {
            kernel->analyse();
        } catch (Error& error) {
            for (const NodePtr& node : graph.nodes)
                for (const auto& [name, argument] : node->arguments)
                    if (const auto* object = argument.get<ObjectPtr>(); object && *object == kernel)
                        error.in_node(node->name);
            throw;
        }
    }
    main_->set_loaded();
}

ScriptHost::~ScriptHost()
{
    {
        const std::lock_guard lock(watch_mutex_);
        stop_watching_ = true;
    }
    watch_wake_.notify_all();
    watchdog_.join();
}

// Leaves the first `results` values that the file returned on the stack.
void ScriptHost::run_file(State& state, int results)
{
    lua_State* L = state.lua();
    state.push_entry("run");
    lua_pushlstring(L, text_.data(), text_.size());
    const std::string name = "@" + graph.file;
    lua_pushlstring(L, name.data(), name.size());
    state.push(options_.knobs ? Value(std::make_shared<const Table>(Table{{}, {}, *options_.knobs})) : Value());
    try {
        state.call(3, results);
    } catch (Error& error) {
        error.at({graph.file, 0});  // where no line is known: a stack overflow, no memory left
        throw;
    }
}

void ScriptHost::collect_outputs(State& state)
{
    lua_State* L = state.lua();
    const auto node_at_top = [&] {
        const auto handle = std::dynamic_pointer_cast<const NodeHandle>(state.to_object(-1));
        return handle ? handle->node : nullptr;
    };
    if (const NodePtr node = node_at_top()) {
        graph.outputs["main"] = node;
    } else if (lua_istable(L, -1)) {
        lua_pushnil(L);
        while (lua_next(L, -2)) {
            const NodePtr output = node_at_top();
            if (lua_type(L, -2) != LUA_TSTRING || !output)
                throw Error("the graph returns a table that holds more than nodes by name; return { main = node, ... }")
                    .at({graph.file, 0});
            graph.outputs[lua_tostring(L, -2)] = output;
            lua_pop(L, 1);
        }
    } else if (!lua_isnil(L, -1)) {
        throw Error(fmt::format("the graph returns {}; it must return a node, or a table of nodes by name",
                                describe(state.to_value(-1))))
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

KernelOrder::Way ScriptHost::kernel_way(const std::string& node) const
{
    const KernelOrder& order = options_.kernel_order;
    return order.node.empty() || order.node == node ? order.way : KernelOrder::Forward;
}

std::unique_ptr<State> ScriptHost::make_worker()
{
    auto state = std::make_unique<State>(*this, false);
    lua_State* L = state->lua();
    run_file(*state, 0);
    if (state->kernel_count() != kernels.size())
        throw Error(
            fmt::format("the graph file made {} kernels at first and {} in a worker; it must do the same each time it "
                        "is run",
                        kernels.size(), state->kernel_count()))
            .at({graph.file, 0});
    for (const std::shared_ptr<Kernel>& kernel : kernels) {
        state->push_entry("fingerprint");
        state->push_kernel(kernel->number);
        state->call(1, 1);
        const bool same = kernel->fingerprint == lua_tostring(L, -1);
        lua_pop(L, 1);
        if (!same)
            throw Error("the kernel is another one when the graph file is run again; it must do the same each time")
                .at(kernel->location);
    }
    state->set_loaded();
    return state;
}

std::optional<ScriptHost::Source> ScriptHost::find_module(std::string_view name, bool node,
                                                          std::string& looked_in) const
{
    // A name is a path of words: nothing above the folders that are searched.
    std::string relative(name);
    const bool words = !relative.empty() && std::all_of(relative.begin(), relative.end(), [](unsigned char c) {
        return std::isalnum(c) || c == '_' || c == '-' || c == '.';
    });
    if (!words || relative.find("..") != std::string::npos) {
        looked_in = "nothing: a module's name is made of letters, digits, _ and dots";
        return std::nullopt;
    }
    std::replace(relative.begin(), relative.end(), '.', '/');

    std::vector<std::filesystem::path> folders = {folder()};
    for (const std::filesystem::path& extra : rapid_path()) folders.push_back(extra);
    if (node) folders.push_back(lua_folder() / "nodes");
    for (const std::filesystem::path& where : folders) {
        const std::filesystem::path path = where / (relative + ".lua");
        if (std::error_code ignored; file_.empty() ? false : std::filesystem::equivalent(path, file_, ignored))
            continue;
        if (options_.on_read) options_.on_read(path);
        if (std::optional<std::string> text = read_text(path)) return Source{std::move(*text), shown(path)};
        looked_in += (looked_in.empty() ? "" : ", ") + shown(path);
    }
    return std::nullopt;
}

std::vector<std::string> ScriptHost::shipped_nodes()
{
    std::vector<std::string> names;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(lua_folder() / "nodes", ignored))
        if (entry.path().extension() == ".lua") names.push_back(entry.path().stem().string());
    std::sort(names.begin(), names.end());
    return names;
}

void ScriptHost::load_shipped_nodes()
{
    for (const std::string& name : shipped_nodes()) {
        main_->push_entry("load_node");
        lua_pushlstring(main_->lua(), name.data(), name.size());
        main_->call(1, 0);
    }
}

namespace {

// Of --script-timeout; longer than any run, and no more than a clock holds.
std::chrono::steady_clock::duration duration_of(double seconds)
{
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(std::min(seconds, 1e7)));
}

}  // namespace

// The watchdog is not woken: it never sleeps for longer than the time that a section has.
ScriptHost::Section::Section(ScriptHost& host, std::string what) : host_(host)
{
    const std::lock_guard lock(host.watch_mutex_);
    // Each of those that run together has its time.
    const auto now = std::chrono::steady_clock::now();
    const auto limit = duration_of(host.options_.script_timeout);
    const auto others = now + limit * static_cast<int>(host.watched_.size());
    host.deadline_ = std::clamp(host.deadline_, now, others) + limit;
    host.watched_.push_back(std::move(what));
}

ScriptHost::Section::~Section()
{
    const std::lock_guard lock(host_.watch_mutex_);
    host_.watched_.pop_back();  // sections end in the reverse order; which name is taken off matters to none
}

// Compiled traces can't be interrupted: when a script overruns, the run ends from here.
void ScriptHost::watch()
{
    std::unique_lock lock(watch_mutex_);
    while (!stop_watching_) {
        const auto now = std::chrono::steady_clock::now();
        if (watched_.empty() || now < deadline_) {
            watch_wake_.wait_until(lock, watched_.empty() ? now + duration_of(options_.script_timeout) : deadline_);
            continue;
        }
        const std::string message =
            fmt::format("{}: the script runs for more than {:g} s; --script-timeout sets the limit",
                        fmt::join(watched_, ", "), options_.script_timeout);
        if (options_.on_timeout) options_.on_timeout(message);
        std::fprintf(stderr, "%s\n", message.c_str());
        std::_Exit(1);
    }
}

}  // namespace rapid

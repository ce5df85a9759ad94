// The scripts of one session: the states, what the constructors made, the kernels, the watchdog.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "bindings/host/kernel.h"
#include "bindings/host/maker_cache.h"
#include "bindings/host/session.h"
#include "bindings/host/state.h"

namespace rapid {

class ScriptHost {
public:
    ScriptHost(const std::filesystem::path& file, SessionOptions options);
    ~ScriptHost();

    // Only the shipped Lua nodes: no graph is run.
    explicit ScriptHost(SessionOptions options);

    Graph graph;
    Registry registry;
    std::vector<Session::Parameter> parameters;
    std::vector<std::string> warnings;

    const SessionOptions& options() const { return options_; }
    std::filesystem::path folder() const { return file_.parent_path(); }
    State& main() { return *main_; }
    // The calling thread's state; made when it is first asked for. Error: the file behaves otherwise than in the main
    // state.
    State& local();
    // A second state of the main thread, for KernelOrder::TwoStates.
    State& second();
    // The way of a node's kernel over the points.
    KernelOrder::Way kernel_way(const std::string& node) const;

    // What the constructors of the main state made, in order; a worker's calls take them from here. A call that failed
    // left its message.
    using Made = std::variant<ObjectPtr, std::string>;
    std::deque<Made> made;
    // While a function of the frame runs: what it has made before.
    MadeBefore* made_before = nullptr;

    std::vector<std::shared_ptr<Kernel>> kernels;

    // The text of a module beside the graph, on RAPID_PATH or, for nodes, among Rapid's own; and the name it goes by.
    struct Source {
        std::string text, name;
    };
    std::optional<Source> find_module(std::string_view name, bool node, std::string& looked_in) const;
    // The names of Rapid's own nodes written in Lua.
    static std::vector<std::string> shipped_nodes();
    void load_shipped_nodes();

    // While it lives the watchdog counts the script's time.
    class Section {
    public:
        Section(ScriptHost& host, std::string what);
        ~Section();

    private:
        ScriptHost& host_;
    };

private:
    std::unique_ptr<State> make_worker();
    void run_file(State& state, int results);
    void collect_outputs(State& state);
    void watch();

    std::filesystem::path file_;
    std::string text_;
    SessionOptions options_;
    std::unique_ptr<State> main_, second_;
    tbb::enumerable_thread_specific<std::unique_ptr<State>> workers_;
    std::thread::id main_thread_;

    std::mutex watch_mutex_;
    std::condition_variable watch_wake_;
    std::vector<std::string> watched_;  // what runs now
    std::chrono::steady_clock::time_point deadline_;
    bool stop_watching_ = false;
    std::thread watchdog_;
};

// Where Rapid's Lua files are: beside the installed program, else in the source tree.
std::filesystem::path lua_folder();

}  // namespace rapid

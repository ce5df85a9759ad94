// The scripts of a session: the states, the objects made by constructors, the kernels.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "bindings/host/interruption.h"
#include "bindings/host/kernel.h"
#include "bindings/host/maker.h"
#include "bindings/host/modules.h"
#include "bindings/host/session.h"
#include "bindings/host/state.h"

namespace rapid {

class ScriptHost {
public:
    // An empty path means that no graph is run.
    ScriptHost(const std::filesystem::path& file, SessionOptions options);

    Graph graph;
    Registry registry;
    std::vector<Session::Parameter> parameters;
    std::map<std::string, std::size_t> parameter_indices;  // by name
    std::vector<std::string> warnings;
    const std::shared_ptr<Interruption> shared_interruption;
    Interruption& interruption;
    std::map<std::string, std::vector<Session::FunctionCode>> code;
    Watchdog watchdog;
    const Modules modules;

    const SessionOptions& options() const { return options_; }
    std::filesystem::path folder() const { return file_.parent_path(); }
    State& main() { return *main_; }
    // Makes the calling thread the one that uses the main state.
    void use_from_this_thread() { main_thread_ = std::this_thread::get_id(); }
    // Returns the calling thread's state, made on first use. Throws Error if the file behaves differently there
    // than in the main state.
    State& local();
    // Returns a second state of the main thread, for KernelOrder::TwoStates.
    State& second();
    // Returns the sequence of points in which a node's kernel runs.
    KernelOrder::Sequence sequence_of(const std::string& node) const;

    // Objects made by the constructors of the main state, in order; a worker's calls take them from here. A call that
    // failed left its message.
    using Made = std::variant<ObjectPtr, Error>;
    std::deque<Made> made;
    // The cache of the running function of the frame, else null.
    MakerCache* maker_cache = nullptr;

    std::vector<std::shared_ptr<Kernel>> kernels;
    // The functions made before the graph had run, if keeps_state is set.
    std::vector<std::shared_ptr<const FrameFunction>> frame_functions;

    void load_shipped_nodes();

private:
    Watchdog::OnTimeout timeout_callback(const SessionOptions& options);
    std::string read_graph() const;
    void run_graph();
    void apply_arguments();
    void analyse_kernels();
    void refuse_memory() const;
    std::unique_ptr<State> make_worker();
    void check_kernels(State& worker) const;
    void run_file(State& state, int results);
    void collect_outputs(State& state);

    std::filesystem::path file_;
    std::string text_;
    SessionOptions options_;
    std::unique_ptr<State> main_, second_;
    tbb::enumerable_thread_specific<std::unique_ptr<State>> workers_;
    std::thread::id main_thread_;
};

}  // namespace rapid

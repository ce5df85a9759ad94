// The implementation of scenes.
#pragma once

#include <tbb/task_arena.h>

#include <atomic>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "bindings/host/picture_scene.h"
#include "bindings/host/session.h"
#include "bindings/run/fingerprint.h"
#include "bindings/scene/offered_meshes.h"
#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_error.h"
#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "runtime/base/cancellation.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/memory_watch.h"
#include "runtime/graph/evaluate.h"

namespace rapid {

// Returns a value in the form of --set.
std::string text_of(const SceneValue& value);

// Returns the error of invalid options, or nothing.
std::optional<SceneError> fault_of(const SceneOptions& options);

// A scene. Its session is run again for other parameters; plan and evaluator are renewed for each start.
struct [[gnu::visibility("hidden")]] Scene::Impl
{
    const std::uint64_t number = next_number();  // among the scenes of the process
    std::string file;
    std::optional<std::string> text;
    SceneOptions options;
    SceneHooks hooks;
    bool keeps_inputs = false;  // the contents of the files that it reads, for its fingerprint
    // Set for a run that writes files.
    bool may_write = false;
    PlanOptions plan_of_run;  // except seed and keep_all, which come from the options
    Evaluator::WriteHook write;
    std::map<std::string, std::string> settings;  // of parameters, by name
    std::shared_ptr<Offers> offers = std::make_shared<Offers>();
    OfferedMeshes offered_meshes = OfferedMeshes(*offers);

    std::unique_ptr<Session> session;
    std::vector<SceneParameter> parameters;
    std::vector<SceneNode> nodes;
    std::vector<SceneOutput> outputs;
    std::vector<std::string> warnings;
    std::unique_ptr<Plan> plan;
    std::shared_ptr<const ErrorSources> errors;  // of the plan
    std::unique_ptr<Evaluator> evaluator;        // null after an error
    std::exception_ptr ended_by;  // the error of a separate frame that left the scene without an evaluator
    std::unique_ptr<SceneOfPlan> picture_scene;
    std::map<std::string, SceneFrame> node_results;  // the points after the nodes in the last requested frame
    std::optional<std::int64_t> node_results_frame;  // its number
    std::shared_ptr<InputContents> inputs;           // of the files that are read; null if they are not recorded
    std::map<std::string, std::string> opened;       // the contents of the files read on opening
    std::int64_t next = 1;
    bool has_advanced = false;

    std::optional<tbb::task_arena> arena;
    std::atomic<bool> is_busy = false;
    std::uint64_t memory_at_first = MemoryWatch::now();

    // State that cancel() may use while another thread is in a call.
    Cancellation cancellation;
    std::mutex scripts_mutex;
    Session* scripts = nullptr;  // those that an advance is running

    // Runs f, the whole of a call: on the scene's threads, with its memory limit, and exceptions as errors. fault: the
    // kind for an ErrorKind::Fault.
    template <class F>
    auto call(SceneError::Kind fault, const F& f)->Result<decltype(f())>
    {
        if (is_busy.exchange(true)) return busy();
        struct Free {
            std::atomic<bool>& is_busy;
            ~Free() { is_busy = false; }
        } const free{is_busy};
        try {
            std::optional<decltype(f())> value;
            const auto run = [&] {
                if (hooks.stop.stop_requested()) throw Cancellation::cancelled();
                const MemoryBudget budget(options.memory);
                if (session) session->use_from_this_thread();
                // Threads that wait in this scene's loops must not take up work of another scene.
                tbb::this_task_arena::isolate([&] { value.emplace(f()); });
            };
            arena ? arena->execute(run) : run();
            return std::move(*value);
        } catch (...) {
            return error_of_call(fault);
        }
    }

    // Returns the current exception inside a catch block.
    SceneError error_of_call(SceneError::Kind fault);
    // read: records the contents of files that the session reads; may be null.
    SessionOptions session_options(const std::map<std::string, std::string>& set,
                                   std::shared_ptr<InputContents> read = nullptr);
    PlanOptions plan_options() const;
    void log_warnings(const std::vector<std::string>& strings) const;
    void take_offers();
    // Runs the file with these settings. If that fails the scene is unchanged.
    void load(std::map<std::string, std::string> set);
    void describe_scene(const Plan& planned);
    // Returns the hash by which snapshots identify their graph.
    std::string hash_of_nodes() const;
    // Starts a new run of the graph: operators hold state, and belong to a plan.
    void start(std::unique_ptr<Plan> fresh);
    // Starts again after an interruption: stopped scripts cannot continue.
    void start_again();
    SceneFrame advance();
    static std::uint64_t next_number();
    // Callable from any thread. If memory runs out, scripts continue to the next chunk.
    void cancel() noexcept;
    SceneTrace trace(const TraceOptions& requested);
    SceneFrame points_after(const std::string& node, std::int64_t frame);
    // Computes frames of another plan of the session. Scripts that had to be stopped do not run again.
    template <class F>
    void run_separately(const F& compute)
    {
        try {
            compute();
        } catch (...) {
            if (session->is_interrupted()) {
                evaluator.reset();
                ended_by = std::current_exception();
            }
            throw;
        }
        session->take_warnings();  // of frames; the run reports them
    }
    // Computes the frames up to this one separately. from: may be null; results: called with each node's.
    void compute_separately(const Plan& separate, std::int64_t frame, const Snapshot* from,
                            Evaluator::ResultHook results);
    // Returns the points after a node of a plan as a frame.
    SceneFrame frame_after_node(const Plan& separate, const PlannedNode& planned, std::int64_t frame, PointSet points)
        const;
    const std::map<std::string, SceneFrame>& points_after_nodes(std::int64_t frame, const SceneSnapshot* from);
    PointOrigin origin(const SceneFrame& frame, std::int64_t id, const SceneSnapshot* from);
    SceneShapes shapes_at(std::int64_t frame);
    void refuse_unless_ready() const;
    void refuse_unless_of_this_graph(const SceneSnapshot& snapshot) const;
    void require_keep_state() const;  // keep_state
    // Returns the callback that SceneHooks::on_memory_exceeded needs, with the position of the computation; empty if no
    // program set that hook.
    MemoryWatch::Callback memory_overrun_callback() const;

    // While it lives, cancel() stops scripts.
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
    // While it lives, the end of a call also ends sessions with these scripts, which are not the scene's: those of
    // opening and of trials.
    struct SeparateCall {
        Cancellation::Scope scope;
        std::optional<MemoryWatch> watch;
        std::stop_callback<std::function<void()>> stop;
        SeparateCall(Impl& impl, const std::shared_ptr<Interruption>& scripts);
    };
    // While it lives, frames are computed, and end when they are cancelled or exceed the memory limit.
    struct Running {
        Scripts scripts;
        Cancellation::Scope scope;
        std::optional<MemoryWatch> watch;
        std::stop_callback<std::function<void()>> stop;
        // Throws Error if it was cancelled before.
        explicit Running(Impl& impl)
            : scripts(impl), scope(&impl.cancellation), stop(impl.hooks.stop, [&impl] { impl.cancel(); })
        {
            if (impl.hooks.watch_memory)
                watch.emplace(
                    impl.memory_at_first,
                    [&impl](const Error& error) {
                        impl.session->interrupt(error);
                        impl.cancellation.request(error);
                    },
                    impl.memory_overrun_callback());
            impl.cancellation.check();
        }
    };
};

}  // namespace rapid

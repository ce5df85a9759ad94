// What a scene is made of.
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

#include "bindings/host/offers.h"
#include "bindings/host/picture_scene.h"
#include "bindings/host/session.h"
#include "bindings/run/fingerprint.h"
#include "bindings/scene/scene_data.h"
#include "bindings/scene/scene_error.h"
#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "runtime/base/cancellation.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/memory_watch.h"
#include "runtime/graph/evaluate.h"

namespace rapid {

// As --set takes it.
std::string text_of(const SceneValue& value);

// What no scene is opened with; nothing where there is no such thing.
std::optional<SceneError> fault_of(const SceneOptions& options);

// One scene. Its session is run again for other parameters; plan and evaluator for each start.
struct [[gnu::visibility("hidden")]] Scene::Impl
{
    const std::uint64_t number = next_number();  // of the scenes of the process
    std::string file;
    std::optional<std::string> text;
    SceneOptions options;
    SceneHooks hooks;
    bool keeps_inputs = false;  // what it reads, for its fingerprint
    // Of a run that writes files.
    bool may_write = false;
    PlanOptions plan_of_run;  // but seed and keep_all, which are those of the options
    Evaluator::WriteHook write;
    std::map<std::string, std::string> settings;  // of parameters, by name
    std::shared_ptr<Offers> offers = std::make_shared<Offers>();

    std::unique_ptr<Session> session;
    std::vector<SceneParameter> parameters;
    std::vector<SceneNode> nodes;
    std::vector<SceneOutput> outputs;
    std::vector<std::string> warnings;
    std::unique_ptr<Plan> plan;
    std::unique_ptr<Evaluator> evaluator;  // null behind an error
    std::exception_ptr ended_by;           // of a frame beside the scene, which left it without an evaluator
    std::unique_ptr<SceneOfPlan> picture_scene;
    std::map<std::string, SceneFrame> behind;   // the points behind the nodes in the frame that was asked for last
    std::optional<std::int64_t> behind_frame;   // which one that is
    std::shared_ptr<InputContents> inputs;      // of the files that are read; null where none are kept
    std::map<std::string, std::string> opened;  // the contents of those of opening
    std::int64_t next = 1;
    bool has_advanced = false;

    std::optional<tbb::task_arena> arena;
    std::atomic<bool> is_busy = false;
    std::uint64_t memory_at_first = MemoryWatch::now();

    // What cancel() may do while another thread is in a call.
    Cancellation cancellation;
    std::mutex scripts_mutex;
    Session* scripts = nullptr;  // that an advance runs now

    // Runs f, the whole of a call: in the scene's threads, with its limit of memory, its exceptions as errors. fault:
    // the kind of an ErrorKind::Fault.
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
                // Of the loops of this scene no thread that waits takes up another scene.
                tbb::this_task_arena::isolate([&] { value.emplace(f()); });
            };
            arena ? arena->execute(run) : run();
            return std::move(*value);
        } catch (...) {
            return error_of_call(fault);
        }
    }

    // What is being handled, inside of a catch block.
    SceneError error_of_call(SceneError::Kind fault);
    // read: keeps the contents of what the session reads; may be null.
    SessionOptions session_options(const std::map<std::string, std::string>& set,
                                   std::shared_ptr<InputContents> read = nullptr);
    PlanOptions plan_options() const;
    void tell(const std::vector<std::string>& texts) const;
    void take_offers();
    // Runs the file with these settings. The scene is as it was where that fails.
    void load(std::map<std::string, std::string> set);
    void describe_scene(const Plan& planned);
    // By which snapshots know their graph.
    std::string hash_of_nodes() const;
    // A new run of the graph: operators keep state, and belong to a plan.
    void start(std::unique_ptr<Plan> fresh);
    // Scripts that were stopped do not run again.
    void start_again();
    SceneFrame advance();
    static std::uint64_t next_number();
    // From any thread. For want of memory scripts go on to the next chunk.
    void cancel() noexcept;
    SceneTrace trace(const TraceOptions& asked);
    SceneFrame points_behind(const std::string& node, std::int64_t frame);
    // Computes frames of another plan of the session. Scripts that had to be stopped do not run again.
    template <class F>
    void beside(const F& compute)
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
        session->take_warnings();  // of frames, which the run tells
    }
    // Computes the frames up to this one beside the scene. from: may be null; results: told of each node's.
    void compute_beside(const Plan& apart, std::int64_t frame, const Snapshot* from, Evaluator::ResultHook results);
    // The points behind a node of a plan as a frame.
    SceneFrame frame_behind(const Plan& apart, const PlannedNode& planned, std::int64_t frame, PointSet points) const;
    const std::map<std::string, SceneFrame>& points_behind_all(std::int64_t frame, const SceneSnapshot* from);
    PointOrigin origin(const SceneFrame& frame, std::int64_t id, const SceneSnapshot* from);
    SceneShapes shapes_at(std::int64_t frame);
    void refuse_unless_ready() const;
    void refuse_unless_of_this_graph(const SceneSnapshot& snapshot) const;
    void refuse_unless_kept() const;  // keep_state
    // What SceneHooks::beyond_memory asks for, with the place of what is computed; empty where nobody does.
    MemoryWatch::Tell too_late() const;

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
    // For as long as it lives, what ends a call also ends sessions with these scripts, which are not the scene's: of
    // opening, and of trials.
    struct Apart {
        Cancellation::Scope scope;
        std::optional<MemoryWatch> watch;
        std::stop_callback<std::function<void()>> stop;
        Apart(Impl& impl, const std::shared_ptr<Interruption>& scripts);
    };
    // For as long as it lives, frames are computed, which end when it is cancelled or takes more memory than its limit.
    struct Running {
        Scripts scripts;
        Cancellation::Scope scope;
        std::optional<MemoryWatch> watch;
        std::stop_callback<std::function<void()>> stop;
        // Error: it was cancelled before.
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
                    impl.too_late());
            impl.cancellation.check();
        }
    };
};

}  // namespace rapid

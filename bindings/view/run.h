// One run of a viewer's scene: a session of its own, on a thread of its own, that publishes frames until it is done or
// abandoned, and answers questions about them between two frames.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bindings/run/fingerprint.h"
#include "bindings/view/simulation.h"
#include "runtime/graph/plan.h"
#include "runtime/graph/snapshot.h"

namespace rapid {

// As an error of the scene.
Error error_of(const std::exception& error);

// Its functions but abandon(), ended() and ask() are the thread's own.
class ViewSimulation::Run {
public:
    Run(ViewSimulation& view, std::uint64_t number);
    ~Run();

    void abandon();
    bool ended() const { return ended_; }

    using Task = std::function<void(Run&)>;
    void ask(Task task);

    // Null: there is no plan, for an error.
    const Plan* plan() const { return plan_.get(); }

    std::shared_ptr<const Results> inspect(std::int64_t frame);
    Arguments arguments(std::int64_t frame) const;
    Origin origin(std::int64_t frame, const std::string& output, std::int64_t id);

private:
    PlanOptions plan_options() const;
    bool stopped() const { return stop_.cancellation.is_requested(); }

    // Calls `change` with the status, unless this run has been abandoned.
    template <class F>
    void tell(const F& change);
    void run();
    void begin();

    // The frames that the cache has.
    void take_known(ViewStatus& status);
    bool is_known(std::int64_t frame) const { return cached_ && cached_->known().contains(frame); }
    std::optional<Snapshot> cached_snapshot_before(std::int64_t frame) const;
    static void warn(ViewStatus& status, std::int64_t frame, const std::string& text);

    // Of files that could not be written.
    void warn_of_cache(ViewStatus& status, std::int64_t frame);
    void compute();

    // is_whole: it has its shapes, and may go to the cache.
    bool publish(const ViewFramePtr& frame, const std::vector<std::string>& warnings, bool is_whole);

    // They share columns with each other and the frames, but not all of them: of many every second is dropped.
    void keep_snapshot(Snapshot snapshot);
    void draw_graph();
    void note_file(const std::filesystem::path& file);

    // Empty: there is none, or the run is to end.
    Task next_task(bool wait);

    ViewSimulation& view_;
    const std::uint64_t number_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<Plan> plan_;
    std::unique_ptr<InputContents> contents_;  // of the files that it reads; null without a cache
    std::shared_ptr<CachedRun> cached_;        // null without a cache
    std::int64_t first_ = 1, last_ = 1;
    std::map<std::int64_t, Snapshot> snapshots_;
    std::shared_ptr<const Results> inspected_;
    std::int64_t inspected_frame_ = 0;

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<Task> tasks_;
    Stop stop_;
    std::atomic<bool> ended_{false};
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid

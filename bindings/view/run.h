// A run of a viewer's scene: a Scene of its own, on a thread of its own, that publishes frames until it is done or
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
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "bindings/scene/scene_inside.h"
#include "bindings/view/simulation.h"

namespace rapid {

// Returns the exception as an error of the scene.
Error error_of(const std::exception& error);

// All functions except abandon(), ended() and enqueue() belong to its own thread.
class ViewSimulation::Run {
public:
    Run(ViewSimulation& view, std::uint64_t number);
    ~Run();

    void abandon();
    bool ended() const { return ended_; }

    using Task = std::function<void(Run&)>;
    void enqueue(Task task);

    // False after an error; then nothing else may be called.
    bool has_scene() const { return scene_.has_value(); }

    Results inspect(std::int64_t frame);
    Arguments arguments(std::int64_t frame);
    PointOrigin origin(std::int64_t frame, const std::string& output, std::int64_t id);

private:
    bool stopped() const { return stop_.stop_requested(); }

    // Calls `change` with the status, unless this run has been abandoned.
    template <class F>
    void update_status(const F& change);
    void run();
    void begin();

    // Adds the frames that the cache has.
    void take_known(ViewStatus& status);
    bool is_known(std::int64_t frame) const { return cached_ && cached_->known().contains(frame); }
    // Returns the latest snapshot in the cache before a frame.
    std::optional<SceneSnapshot> cached_snapshot_before(std::int64_t frame) const;
    std::optional<SceneSnapshot> snapshot_before(std::int64_t frame) const;
    static void warn(ViewStatus& status, std::int64_t frame, const std::string& text);

    // Warns about files that could not be written.
    void warn_of_cache(ViewStatus& status, std::int64_t frame);
    void compute();

    // count_before: the number of warnings already reported. is_whole: it has its shapes, and may go to the cache.
    bool publish(const ViewFramePtr& frame, const std::vector<std::string>& warnings, std::size_t count_before,
                 bool is_whole);

    // Snapshots share most, not all, of their columns with each other and with frames; if there are many, every second
    // one is dropped.
    void keep_snapshot(const SceneSnapshot& snapshot);
    void draw_graph();

    // Returns an empty task if there is none, or if the run is to end.
    Task next_task(bool wait);

    ViewSimulation& view_;
    const std::uint64_t number_;
    std::optional<Scene> scene_;
    std::shared_ptr<CachedRun> cached_;  // null without a cache
    std::int64_t first_ = 1, last_ = 1;
    std::map<std::int64_t, SceneSnapshot> snapshots_;
    std::optional<std::int64_t> inspected_;  // the frame of which the scene has the points after nodes

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<Task> tasks_;
    std::stop_source stop_;
    std::atomic<bool> ended_{false};
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid

// The simulation in a viewer: a scene that is run again whenever something changes, or the files of a sequence.
//
// Each run has its own thread and Scene. A change abandons the run: its scripts and the substeps of Solve end within
// the frame (SceneHooks::stop), while the next run has already begun. At most two runs end at the same time; then the
// next one waits.
#pragma once

#include <atomic>
#include <condition_variable>
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
#include "bindings/view/frame_store.h"
#include "include/rapid/scene.h"
#include "runtime/base/error.h"

namespace rapid {

struct ViewOptions {
    std::string graph;
    SceneOptions scene;
    std::optional<std::pair<std::int64_t, std::int64_t>> frames;
    std::map<int, std::filesystem::path> files;  // a sequence has no graph
    int threads = 1;
    std::size_t memory = 0;       // bytes for frames
    std::filesystem::path cache;  // folder that also stores frames; empty: none
    bool is_confined = false;     // --untrusted: starts no other programs
};

enum class ViewState { Starting, Computing, Done, Full, Failed };

// The page's state besides frames.
struct ViewStatus {
    std::uint64_t version = 0;  // incremented with every change
    std::uint64_t run = 0;
    ViewState state = ViewState::Starting;
    std::int64_t first = 1, last = 1;
    double fps = 24;
    std::optional<Error> error;
    std::vector<std::pair<std::int64_t, std::string>> warnings;  // with their first frames; 0: none
    std::uint64_t more_warnings = 0;                             // not stored
    std::vector<SceneParameter> parameters;
    std::vector<std::string> outputs;
    std::shared_ptr<const std::string> graph;  // the picture as JSON; null if there is none
    std::uint64_t graph_number = 0;            // incremented with each new picture
    std::string no_graph;                      // the reason
    std::map<std::string, int> names;          // attributes and groups of the plan, with bytes per point; -1 if pruned
};

class ViewSimulation {
public:
    // changed: called from any thread, whenever version grows. Throws Error for the cache's folder.
    ViewSimulation(ViewOptions options, std::function<void()> changed);
    ~ViewSimulation();

    // Restarts with other values of parameters.
    void set(std::map<std::string, std::string> values);
    std::map<std::string, std::string> values() const;
    // Restarts if a file that the last run read has changed. Returns true if so.
    bool check_files();

    ViewStatus status() const;
    // Returns the number of abandoned runs that have not ended yet. Called from the thread that calls set().
    std::size_t ending() const;
    // Returns null if the frame is not computed. Reads the file of a sequence. Throws Error if it cannot be read.
    ViewFramePtr frame(std::int64_t number);
    FrameStore& store() { return store_; }
    const FrameStore& store() const { return store_; }
    bool is_sequence() const { return !options_.files.empty(); }
    const ViewOptions& options() const { return options_; }

    // Calls `callback` from the run's thread with the points after each node in a frame, by name, or with an error. The
    // run then continues.
    using Results = std::map<std::string, SceneFrame>;
    void inspect(std::int64_t frame, std::function<void(Results, std::string error)> callback);
    // Calls back likewise with the arguments of the nodes in a frame, as strings by node and name.
    using Arguments = std::map<std::string, std::map<std::string, std::string>>;
    void arguments(std::int64_t frame, std::function<void(Arguments, std::string error)> callback);
    // Calls back likewise with the create node that made a point of an output in a frame, and its id there: merged
    // chains get other ids.
    void origin(std::int64_t frame, std::string output, std::int64_t id,
                std::function<void(PointOrigin, std::string error)> callback);
    // Calls back with the life of a point up to a frame, as JSON, from its own thread and scene.
    void trace(const PointOrigin& point, std::int64_t last,
               std::function<void(std::string json, std::string error)> callback);

private:
    class Run;
    void begin();
    void collect_ended();
    void note_file(std::uint64_t run, const std::filesystem::path& file);
    // Returns the options of the scene that a run or a trace opens, with the values of parameters.
    SceneOptions scene_options() const;
    GraphLayout layout() const;
    void keep(GraphLayout layout);
    ViewFramePtr read_file(std::int64_t number);
    template <class T>
    void query_run(std::function<T(Run&)> answer, std::function<void(T, std::string error)> callback);

    const ViewOptions options_;
    const std::function<void()> changed_;
    FrameStore store_;
    std::unique_ptr<FrameCache> cache_;  // null if there is none
    mutable std::mutex mutex_;
    ViewStatus status_;
    std::map<std::filesystem::path, std::filesystem::file_time_type> read_;  // files, with their times of change
    std::map<std::string, std::string> values_;
    GraphLayout layout_;  // of the last run: most changes leave the graph unchanged
    std::unique_ptr<Run> run_;
    std::deque<std::unique_ptr<Run>> ending_;
    std::atomic<std::uint64_t> file_uses_ = 0;  // in a sequence: counts the files that were read
    std::stop_source tracer_stop_;
    std::thread tracer_;
};

}  // namespace rapid

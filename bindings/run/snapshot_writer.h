// Writes snapshots while the run goes on, as frames are: one at a time, on a thread of its own, and at most one waits.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "runtime/checked_json.h"
#include "runtime/points/saved_state.h"

namespace rapid {

class SnapshotWriter {
public:
    SnapshotWriter();
    // Completes what was submitted.
    ~SnapshotWriter();

    // Waits while another one waits. The state shares its columns with the run.
    void submit(std::filesystem::path file, CheckedJson header, SavedState state);
    // Waits until all are written.
    void finish();
    // Why files could not be written, since the last call.
    std::vector<std::string> take_failures();

private:
    struct Job {
        std::filesystem::path file;
        CheckedJson header;
        SavedState state;
    };
    void run();

    std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Job> waiting_;
    bool is_busy_ = false, is_stopping_ = false;
    std::vector<std::string> failures_;
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid

// Writes files while the run goes on: one at a time, on a thread of its own, and at most one waits.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace rapid {

class FileWriter {
public:
    // what: that a run does without where it can't be written, "snapshot".
    explicit FileWriter(std::string what);
    // Completes what was submitted.
    ~FileWriter();

    // Throws why the file can't be written.
    using Write = std::function<void(const std::filesystem::path& path)>;
    // Waits while another one waits. What `write` holds is released when it is done.
    void submit(std::filesystem::path path, Write write);
    // Waits until all are written.
    void finish();
    // Why files could not be written, since the last call.
    std::vector<std::string> take_failures();

private:
    struct Job {
        std::filesystem::path path;
        Write write;
    };
    void run();

    const std::string what_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Job> waiting_;
    bool is_busy_ = false, is_stopping_ = false;
    std::vector<std::string> failures_;
    std::thread thread_;  // the last member: it starts when the others are initialised
};

}  // namespace rapid

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

#include "include/rapid/scene.h"

namespace rapid {

class FileWriter {
public:
    FileWriter();
    // Completes what was submitted.
    ~FileWriter();

    using Write = std::function<Result<Done>(const std::string& path)>;
    // Waits while another one waits.
    void submit(const std::filesystem::path& file, Write write);
    // Waits until all are written.
    void finish();
    // Why files could not be written, since the last call.
    std::vector<std::string> take_failures();

private:
    struct Job {
        std::string path;
        Write write;
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

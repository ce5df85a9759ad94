#include "runtime/files/file_writer.h"

#include <fmt/format.h>

#include <exception>
#include <utility>

namespace rapid {

FileWriter::FileWriter(std::string what) : what_(std::move(what))
{
    thread_ = std::thread([this] { run(); });
}

FileWriter::~FileWriter()
{
    {
        const std::lock_guard lock(mutex_);
        is_stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void FileWriter::submit(std::filesystem::path path, Write write)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_; });
    waiting_ = Job{std::move(path), std::move(write)};
    changed_.notify_all();
}

void FileWriter::finish()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_ && !is_busy_; });
}

std::vector<std::string> FileWriter::take_failures()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(failures_, {});
}

void FileWriter::run()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return is_stopping_ || waiting_; });
        if (!waiting_) return;
        std::optional<Job> job = std::exchange(waiting_, std::nullopt);
        is_busy_ = true;
        changed_.notify_all();
        lock.unlock();
        std::string failure;
        try {
            job->write(job->path);
        } catch (const std::exception& error) {
            failure = fmt::format("{}: {}; the run goes on without this {}", job->path.string(), error.what(), what_);
        }
        job.reset();  // releases its columns before the next frame would copy them
        lock.lock();
        is_busy_ = false;
        if (!failure.empty()) failures_.push_back(std::move(failure));
        changed_.notify_all();
    }
}

}  // namespace rapid

#include "bindings/run/snapshot_writer.h"

#include <fmt/format.h>

#include <exception>
#include <utility>

#include "runtime/io/state_file.h"

namespace rapid {
namespace {

std::string failure_of(const std::filesystem::path& path, const CheckedJson& header, const SavedState& state)
{
    try {
        OutputFile file(path);
        write_state(file, header, state);
        file.finish();
        return "";
    } catch (const std::exception& error) {
        return fmt::format("{}: {}; the run goes on without this snapshot", path.string(), error.what());
    }
}

}  // namespace

SnapshotWriter::SnapshotWriter()
{
    thread_ = std::thread([this] { run(); });
}

SnapshotWriter::~SnapshotWriter()
{
    {
        const std::lock_guard lock(mutex_);
        is_stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void SnapshotWriter::submit(std::filesystem::path file, CheckedJson header, SavedState state)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_; });
    waiting_ = Job{std::move(file), std::move(header), std::move(state)};
    changed_.notify_all();
}

void SnapshotWriter::finish()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_ && !is_busy_; });
}

std::vector<std::string> SnapshotWriter::take_failures()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(failures_, {});
}

void SnapshotWriter::run()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return is_stopping_ || waiting_; });
        if (!waiting_) return;
        std::optional<Job> job = std::exchange(waiting_, std::nullopt);
        is_busy_ = true;
        changed_.notify_all();
        lock.unlock();
        std::string failure = failure_of(job->file, job->header, job->state);
        job.reset();  // releases its columns before the next frame would copy them
        lock.lock();
        is_busy_ = false;
        if (!failure.empty()) failures_.push_back(std::move(failure));
        changed_.notify_all();
    }
}

}  // namespace rapid

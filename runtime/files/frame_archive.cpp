#include "runtime/files/frame_archive.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <exception>
#include <iterator>
#include <utility>

#include "runtime/base/memory_budget.h"
#include "runtime/base/setting_names.h"
#include "runtime/base/stopwatch.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/input_file.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view journal_magic = "\x89RAPIDJ\n";
constexpr std::string_view suffix = ".rapid";
constexpr double longest_wait = 5;  // s, for the owner of the lock to end

struct Head {
    std::uint64_t bytes, hash;  // of the record
};

Head head_of(std::string_view record) { return {record.size(), content_hash(record)}; }

// Returns false if the file ends earlier.
bool read_at(int file, std::uint64_t offset, void* data, std::size_t bytes)
{
    for (char* to = static_cast<char*>(data); bytes > 0;) {
        const ssize_t count = ::pread(file, to, bytes, static_cast<off_t>(offset));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw file_error("can't be read", errno);
        if (count == 0) return false;
        to += count;
        offset += static_cast<std::uint64_t>(count);
        bytes -= static_cast<std::size_t>(count);
    }
    return true;
}

}  // namespace

RecordLog::RecordLog(const fs::path& path)
    : file_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666))
{
    if (!file_) throw file_error("can't be opened", errno);
}

RecordLog RecordLog::in_memory()
{
    RecordLog log(Descriptor(::memfd_create("rapid records", MFD_CLOEXEC)));
    if (!log.file_) throw file_error("not enough memory for records", errno);
    return log;
}

std::uint64_t RecordLog::size() const
{
    struct stat status = {};
    if (::fstat(file_.number(), &status) != 0) throw file_error("can't be read", errno);
    return static_cast<std::uint64_t>(status.st_size);
}

// Writes in one call if the system accepts everything, so that a killed process leaves no part of a small record.
void RecordLog::append(std::string_view record)
{
    const std::uint64_t size_before = size();
    Head head = head_of(record);
    iovec parts[] = {{&head, sizeof head}, {const_cast<char*>(record.data()), record.size()}};
    std::uint64_t at = end_;
    for (iovec* part = std::begin(parts); part != std::end(parts);) {
        const auto left = static_cast<int>(std::end(parts) - part);
        const ssize_t count = ::pwritev(file_.number(), part, left, static_cast<off_t>(at));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) {
            const int reason = count < 0 ? errno : ENOSPC;
            if (::ftruncate(file_.number(), static_cast<off_t>(size_before)) != 0)
                throw file_error("can't be written or truncated", errno);
            throw file_error("can't be written", reason);
        }
        at += static_cast<std::uint64_t>(count);
        auto written = static_cast<std::size_t>(count);
        for (; part != std::end(parts) && written >= part->iov_len; ++part) written -= part->iov_len;
        if (part == std::end(parts)) break;
        part->iov_base = static_cast<char*>(part->iov_base) + written;
        part->iov_len -= written;
    }
    end_ = at;
}

bool RecordLog::read(std::uint64_t& position, std::string& record) const
{
    const std::uint64_t end = size();
    Head head;
    if (position > end || end - position < sizeof head || !read_at(file_.number(), position, &head, sizeof head) ||
        head.bytes > end - position - sizeof head)
        return false;
    if (!fits_in_memory(static_cast<double>(head.bytes)))
        throw memory_exceeded("a record of it", static_cast<double>(head.bytes), "choose another folder");
    record.resize(head.bytes);
    if (!read_at(file_.number(), position + sizeof head, record.data(), record.size()) ||
        content_hash(record) != head.hash)
        return false;
    position += sizeof head + record.size();
    return true;
}

void RecordLog::clear()
{
    if (::ftruncate(file_.number(), 0) != 0) throw file_error("can't be emptied", errno);
    end_ = 0;
}

Descriptor FrameArchive::lock(const fs::path& folder, const fs::path& shown_as, const char* who)
{
    const auto refuse = [&](const std::string& why) {
        throw Error(fmt::format("{} {}: {}", name_of(Setting::Cache), shown_as.string(), why));
    };
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) refuse("can't be made: " + error.message());
    // Following a link would create a file elsewhere.
    Descriptor lock(::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
    if (!lock && errno == ELOOP) refuse("its .lock is a link; choose another folder");
    const Stopwatch waited;
    while (lock && ::flock(lock.number(), LOCK_EX | LOCK_NB) != 0) {
        if (errno == EINTR) continue;
        if (errno != EWOULDBLOCK) break;  // the file system has no locks
        if (waited.seconds() > longest_wait)
            refuse(fmt::format("another {} is using it; wait for its end, or choose another folder", who));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return lock;
}

fs::path FrameArchive::file(std::string_view kind, std::int64_t frame) const
{
    return folder_ / fmt::format("{}.{:04}{}", kind, frame, suffix);
}

std::map<std::int64_t, fs::path> FrameArchive::files(std::string_view kind) const
{
    std::map<std::int64_t, fs::path> found;
    std::error_code error;
    for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (!name.starts_with(kind) || !name.ends_with(suffix) || name.size() < kind.size() + 1 + suffix.size() ||
            name[kind.size()] != '.')
            continue;
        std::int64_t frame = 0;
        const char* const last = name.data() + name.size() - suffix.size();
        const auto parsed = std::from_chars(name.data() + kind.size() + 1, last, frame);
        if (parsed.ec == std::errc() && parsed.ptr == last && entry->is_regular_file()) found[frame] = entry->path();
    }
    return found;
}

FrameArchive::~FrameArchive()
{
    {
        const std::lock_guard lock(mutex_);
        is_stopping_ = true;
    }
    changed_.notify_all();
    if (writer_.joinable()) writer_.join();
}

void FrameArchive::submit(std::string_view kind, std::int64_t frame, Write write)
{
    std::unique_lock lock(mutex_);
    if (!writer_.joinable()) writer_ = std::thread([this] { write_files(); });
    changed_.wait(lock, [&] { return !waiting_; });
    waiting_ = Job{file(kind, frame), std::move(write)};
    changed_.notify_all();
}

void FrameArchive::finish()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !waiting_ && !is_busy_; });
}

std::vector<std::string> FrameArchive::take_failures()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(failures_, {});
}

void FrameArchive::write_files()
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
            const std::string name = job->path.filename().string();
            failure = fmt::format("{}: {}; the run continues without this {}", job->path.string(), error.what(),
                                  name.substr(0, name.find('.')));
        }
        job.reset();  // releases its columns, which the next frame would otherwise have to copy
        lock.lock();
        is_busy_ = false;
        if (!failure.empty()) failures_.push_back(std::move(failure));
        changed_.notify_all();
    }
}

std::optional<FrameArchive::Records> FrameArchive::read_journal() const
{
    if (!fs::exists(journal())) return std::nullopt;
    Records records;
    const InputFile input = [&] {
        try {
            return InputFile(journal());
        } catch (Error& error) {
            throw error.at({journal().string(), 0});
        }
    }();
    std::string_view text = input.text();
    if (!text.starts_with(journal_magic)) {
        records.damaged = 1;
        return records;
    }
    text.remove_prefix(journal_magic.size());
    while (!text.empty()) {
        Head head;
        if (text.size() < sizeof head) break;
        std::memcpy(&head, text.data(), sizeof head);
        if (head.bytes > text.size() - sizeof head) break;
        const std::string_view record = text.substr(sizeof head, static_cast<std::size_t>(head.bytes));
        text.remove_prefix(sizeof head + record.size());
        if (content_hash(record) == head.hash)
            records.whole.emplace_back(record);
        else
            ++records.damaged;
    }
    if (!text.empty()) ++records.damaged;
    return records;
}

void FrameArchive::begin_journal(const std::vector<std::string>& records)
{
    try {
        OutputFile file(journal());
        file.append(journal_magic.data(), journal_magic.size());
        for (const std::string& record : records) {
            const Head head = head_of(record);
            file.append(&head, sizeof head);
            file.append(record.data(), record.size());
        }
        file.finish();
        journal_.emplace(journal());
        journal_->continue_at(file.appended());
    } catch (const std::exception& error) {
        const std::lock_guard lock(mutex_);
        failures_.push_back(
            fmt::format("{}: {}; the run continues, but its results are not stored", journal().string(), error.what()));
    }
}

void FrameArchive::add(std::string_view record)
{
    if (journal_) journal_->append(record);
}

}  // namespace rapid

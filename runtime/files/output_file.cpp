#include "runtime/files/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <deque>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view hidden_prefix = ".rapid-", hidden_suffix = ".unfinished";

// Set when the process is about to end. Files that are opened afterwards are discarded.
std::atomic<bool> ending{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

std::atomic<bool> durable{false};

Error ending_error() { return Error("can't be written: the run is being stopped"); }

void make_folder(const fs::path& folder)
{
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Error(fmt::format("can't make the folder \"{}\": {}", folder.string(), error.message()));
}

bool is_hidden_name(std::string_view name)
{
    return name.size() == hidden_prefix.size() + 16 + hidden_suffix.size() && name.starts_with(hidden_prefix) &&
           name.ends_with(hidden_suffix);
}

// Removes a hidden file if its process, and with it the lock, is gone.
void remove_if_abandoned(const fs::path& path)
{
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat opened = {}, named = {};
    if (!file || ::flock(file.number(), LOCK_EX | LOCK_NB) != 0) return;
    if (::fstat(file.number(), &opened) != 0 || !S_ISREG(opened.st_mode)) return;
    if (::lstat(path.c_str(), &named) != 0 || named.st_ino != opened.st_ino || named.st_dev != opened.st_dev) return;
    ::unlink(path.c_str());
}

// Runs once per folder, or again later if there are very many folders.
void remove_abandoned_files(const fs::path& folder)
{
    constexpr std::size_t remembered = 1000;
    static std::mutex mutex;
    static std::set<fs::path> seen;
    const std::lock_guard lock(mutex);
    if (seen.size() == remembered) seen.clear();
    if (!seen.insert(folder).second) return;
    std::error_code error;  // a folder that can't be listed may still be writable
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        if (is_hidden_name(entry->path().filename().native())) remove_if_abandoned(entry->path());
}

// Identifies a file that this process wrote and that has not been replaced or changed since. Includes the time of the
// last status change, which no program can set.
using Identity = std::array<std::int64_t, 7>;

Identity identity_of(const struct stat& status)
{
    return {static_cast<std::int64_t>(status.st_dev),
            static_cast<std::int64_t>(status.st_ino),
            status.st_size,
            status.st_mtim.tv_sec,
            status.st_mtim.tv_nsec,
            status.st_ctim.tv_sec,
            status.st_ctim.tv_nsec};
}

// The most recent files. A run that reads its own files usually does so soon.
struct OwnFiles {
    static constexpr std::size_t most = 256;
    std::mutex mutex;
    std::deque<Identity> files;
};

OwnFiles& own_files()
{
    static OwnFiles all;
    return all;
}

void remember_own(int descriptor)
{
    struct stat status = {};
    if (::fstat(descriptor, &status) != 0) return;
    OwnFiles& own = own_files();
    const std::lock_guard lock(own.mutex);
    if (own.files.size() == OwnFiles::most) own.files.pop_front();
    own.files.push_back(identity_of(status));
}

// Returns true if /proc is available, through which an unnamed file gets its name.
bool can_name_descriptors()
{
    static const bool mounted = ::access("/proc/self/fd", X_OK) == 0;
    return mounted;
}

// The names to remove. Entries are reused but never freed, because a signal handler may be traversing the list.
struct Entry {
    enum State { Free, Claimed, Named };
    std::atomic<int> state{Claimed};
    char name[PATH_MAX];
    Entry* next = nullptr;
};

std::atomic<Entry*> entries{nullptr};

Entry* claim_entry()
{
    for (Entry* entry = entries.load(); entry; entry = entry->next) {
        int free = Entry::Free;
        if (entry->state.compare_exchange_strong(free, Entry::Claimed)) return entry;
    }
    Entry* entry = new Entry;
    entry->next = entries.load();
    while (!entries.compare_exchange_weak(entry->next, entry)) {
    }
    return entry;
}

std::array<std::atomic<pid_t>, 16> writing_programs{};  // 0: none
static_assert(std::atomic<pid_t>::is_always_lock_free, "a signal handler reads them");

}  // namespace

WritingProgram::WritingProgram(pid_t program)
{
    for (std::atomic<pid_t>& slot : writing_programs) {
        pid_t none = 0;
        if (!slot.compare_exchange_strong(none, program)) continue;
        slot_ = &slot;
        if (ending) ::kill(program, SIGKILL);  // remove_unfinished_files() will not run again
        return;
    }
}

WritingProgram::~WritingProgram()
{
    if (slot_) *slot_ = 0;
}

// A random name. The destructor or remove_unfinished_files() removes its file, unless the name was given away.
class OutputFile::HiddenName {
public:
    explicit HiddenName(const fs::path& folder)
    {
        std::uint64_t random = 0;
        if (::getrandom(&random, sizeof random, 0) != sizeof random) throw file_error("can't be written", errno);
        path_ = folder / fmt::format("{}{:016x}{}", hidden_prefix, random, hidden_suffix);
        if (path_.native().size() >= PATH_MAX) throw file_error("can't be written", ENAMETOOLONG);
        if (ending) throw ending_error();
        entry_ = claim_entry();
        std::strcpy(entry_->name, path_.c_str());
        entry_->state = Entry::Named;
    }
    ~HiddenName()
    {
        if (!renamed_) ::unlink(path_.c_str());
        entry_->state = Entry::Free;
    }
    HiddenName(const HiddenName&) = delete;
    HiddenName& operator=(const HiddenName&) = delete;

    const char* c_str() const { return path_.c_str(); }
    // Throws Error if the process is about to end. Call this once a file of that name exists.
    void check_not_ending() const
    {
        if (ending) throw ending_error();
    }
    void rename_to(const fs::path& path)
    {
        if (::rename(path_.c_str(), path.c_str()) != 0) throw file_error("can't be named when complete", errno);
        renamed_ = true;
    }

private:
    fs::path path_;
    Entry* entry_;
    bool renamed_ = false;
};

OutputFile::OutputFile(const fs::path& path, Unfinished unfinished)
    : path_(path), folder_(path.has_parent_path() ? path.parent_path() : fs::path("."))
{
    if (path.native().find('\0') != std::string::npos) throw Error("can't be written: its name contains a zero byte");
    make_folder(folder_);
    std::error_code error;
    const fs::file_status status = fs::status(path_, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) throw Error("can't be written: it is not a regular file");
    remove_abandoned_files(folder_);
    if (unfinished == Unfinished::Unnamed && can_name_descriptors()) open_unnamed();
    if (!descriptor_) open_hidden();
    if (ending) throw ending_error();
}

OutputFile::~OutputFile() = default;

// Leaves the file closed if the file system has no unnamed files.
void OutputFile::open_unnamed()
{
    descriptor_ = Descriptor(::open(folder_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666));
    if (!descriptor_ && errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)
        throw file_error("can't be written", errno);
}

void OutputFile::open_hidden()
{
    while (true) {
        hidden_ = std::make_unique<HiddenName>(folder_);
        descriptor_ = Descriptor(::open(hidden_->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
        if (!descriptor_ && errno == EEXIST) continue;
        if (!descriptor_) throw file_error("can't be written", errno);
        hidden_->check_not_ending();
        lock();
        // Another process may have considered it abandoned before it was locked.
        struct stat status = {};
        if (::fstat(descriptor_.number(), &status) == 0 && status.st_nlink > 0) return;
    }
}

// Locks the file. If the file system has no locks, other processes cannot get one either.
void OutputFile::lock()
{
    while (::flock(descriptor_.number(), LOCK_EX) != 0 && errno == EINTR) {
    }
}

void OutputFile::write_at(std::uint64_t offset, const void* data, std::size_t bytes)
{
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = ::pwrite(descriptor_.number(), from, bytes, static_cast<off_t>(offset));
        if (written < 0) {
            if (errno == EINTR) continue;
            throw file_error("can't be written", errno);
        }
        // A full device may accept 0 bytes without an error.
        if (written == 0) throw file_error("can't be written", ENOSPC);
        from += written;
        offset += static_cast<std::uint64_t>(written);
        bytes -= static_cast<std::size_t>(written);
    }
}

void OutputFile::append(const void* data, std::size_t bytes)
{
    write_at(appended_, data, bytes);
    appended_ += bytes;
}

// Ensures that all bytes have reached the file system, even if it delays writes (quotas, network). Closing any
// descriptor reports failures. Closing a duplicate leaves the file and its lock open until it has its name.
void OutputFile::complete()
{
    if (durable && ::fsync(descriptor_.number()) != 0) throw file_error("can't be written", errno);
    const int duplicate = ::fcntl(descriptor_.number(), F_DUPFD_CLOEXEC, 0);
    if (duplicate < 0 || ::close(duplicate) != 0) throw file_error("can't be written", errno);
}

// Returns false if the name is taken.
bool OutputFile::link_to(const fs::path& name)
{
    const std::string from = hidden_ ? hidden_->c_str() : fmt::format("/proc/self/fd/{}", descriptor_.number());
    if (::linkat(AT_FDCWD, from.c_str(), AT_FDCWD, name.c_str(), hidden_ ? 0 : AT_SYMLINK_FOLLOW) == 0) return true;
    if (errno != EEXIST) throw file_error("can't be named when complete", errno);
    return false;
}

void OutputFile::link_to_hidden()
{
    lock();
    while (true) {
        auto name = std::make_unique<HiddenName>(folder_);
        if (!link_to(name->c_str())) continue;
        hidden_ = std::move(name);
        return hidden_->check_not_ending();
    }
}

void OutputFile::finish()
{
    complete();
    // An existing name is replaced by renaming, which is impossible for an unnamed file.
    if (hidden_ || !link_to(path_)) {
        if (!hidden_) link_to_hidden();
        hidden_->rename_to(path_);
    }
    keep_name();
}

bool OutputFile::finish_unless_taken()
{
    complete();
    if (!link_to(path_)) return false;
    keep_name();
    return true;
}

// Makes the name survive a power cut, which requires that the folder is synchronised too.
void OutputFile::keep_name()
{
    remember_own(descriptor_.number());
    if (!durable) return;
    const Descriptor folder(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!folder || ::fsync(folder.number()) != 0) throw file_error("can't be written", errno);
}

bool is_own_file(const fs::path& path)
{
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0) return false;
    OwnFiles& own = own_files();
    const std::lock_guard lock(own.mutex);
    return std::find(own.files.begin(), own.files.end(), identity_of(status)) != own.files.end();
}

void make_files_durable() { durable = true; }

void remove_unfinished_files() noexcept
{
    ending = true;
    for (Entry* entry = entries.load(); entry; entry = entry->next)
        if (entry->state == Entry::Named) ::unlink(entry->name);
    for (const std::atomic<pid_t>& program : writing_programs)
        if (const pid_t writing = program) ::kill(writing, SIGKILL);
}

OutputBuffer::OutputBuffer(OutputFile& file) : file_(file), block_(std::size_t{1} << 20)
{
    setp(block_.data(), block_.data() + block_.size());
}

void OutputBuffer::flush()
{
    file_.write_at(offset_, pbase(), static_cast<std::size_t>(pptr() - pbase()));
    offset_ += static_cast<std::uint64_t>(pptr() - pbase());
    setp(block_.data(), block_.data() + block_.size());
}

OutputBuffer::int_type OutputBuffer::overflow(int_type c)
{
    flush();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
}

int OutputBuffer::sync()
{
    flush();
    return 0;
}

OutputBuffer::pos_type OutputBuffer::seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode)
{
    const std::uint64_t here = offset_ + static_cast<std::uint64_t>(pptr() - pbase());
    end_ = std::max(end_, here);
    if (direction == std::ios_base::cur && offset == 0) return pos_type(static_cast<off_type>(here));
    const off_type base = direction == std::ios_base::beg   ? 0
                          : direction == std::ios_base::cur ? static_cast<off_type>(here)
                                                            : static_cast<off_type>(end_);
    flush();
    offset_ = static_cast<std::uint64_t>(base + offset);
    return pos_type(base + offset);
}

OutputBuffer::pos_type OutputBuffer::seekpos(pos_type position, std::ios_base::openmode mode)
{
    return seekoff(off_type(position), std::ios_base::beg, mode);
}

}  // namespace rapid

#include "runtime/io/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <system_error>
#include <utility>

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Set when the process is about to end: files that are opened later do not stay.
std::atomic<bool> ending{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

Error ending_error() { return Error("can't be written: the run is being stopped"); }

}  // namespace

Error file_error(const std::string& what, int system_error)
{
    return Error(fmt::format("{}: {}", what, std::generic_category().message(system_error)));
}

OutputFile::OutputFile(const fs::path& path)
{
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) throw file_error("can't be written", errno);
    if (ending) {
        ::unlink(path.c_str());
        ::close(std::exchange(descriptor_, -1));
        throw ending_error();
    }
}

OutputFile::~OutputFile()
{
    if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::write_at(std::uint64_t offset, const void* data, std::size_t bytes)
{
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = ::pwrite(descriptor_, from, bytes, static_cast<off_t>(offset));
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

void OutputFile::close()
{
    if (::close(std::exchange(descriptor_, -1)) != 0) throw file_error("can't be written", errno);
}

InputFile::InputFile(const fs::path& path)
{
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) throw file_error("can't be read", errno);
    struct stat status = {};
    int error = ::fstat(descriptor, &status) == 0 ? 0 : errno;
    if (!error && S_ISDIR(status.st_mode)) error = EISDIR;
    if (!error && status.st_size > 0) {
        size_ = static_cast<std::size_t>(status.st_size);
        void* mapped = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
        if (mapped == MAP_FAILED)
            error = errno;
        else
            data_ = static_cast<const unsigned char*>(mapped);
    }
    ::close(descriptor);
    if (error) throw file_error("can't be read", error);
}

InputFile::~InputFile()
{
    if (data_) ::munmap(const_cast<unsigned char*>(data_), size_);
}

// Entries are reused but never freed: a signal handler may be traversing the list.
struct UnfinishedFile::Entry {
    enum State { Free, Claimed, Named };
    std::atomic<int> state{Claimed};
    char name[PATH_MAX];
    Entry* next = nullptr;
};

namespace {

std::atomic<UnfinishedFile::Entry*> entries{nullptr};

UnfinishedFile::Entry* claim_entry()
{
    using Entry = UnfinishedFile::Entry;
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

void make_folder(const fs::path& folder)
{
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Error(fmt::format("can't make the folder \"{}\": {}", folder.string(), error.message()));
}

}  // namespace

UnfinishedFile::UnfinishedFile(const fs::path& final_path) : final_path_(final_path), entry_(nullptr)
{
    const fs::path folder = final_path.has_parent_path() ? final_path.parent_path() : fs::path(".");
    make_folder(folder);
    std::error_code error;
    const fs::file_status status = fs::status(final_path, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) throw Error("can't be written: it is not a regular file");

    static std::atomic<unsigned> serial{0};
    path_ = folder / fmt::format(".rapid-{}-{}.unfinished", ::getpid(), serial++);
    if (path_.native().size() >= PATH_MAX) throw file_error("can't be written", ENAMETOOLONG);
    if (ending) throw ending_error();

    entry_ = claim_entry();
    std::strcpy(entry_->name, path_.c_str());
    entry_->state = Entry::Named;
}

UnfinishedFile::~UnfinishedFile()
{
    if (!entry_) return;
    ::unlink(path_.c_str());
    entry_->state = Entry::Free;
}

void UnfinishedFile::finish()
{
    if (::rename(path_.c_str(), final_path_.c_str()) != 0) throw file_error("can't be renamed when complete", errno);
    entry_->state = Entry::Free;
    entry_ = nullptr;
}

void remove_unfinished_files() noexcept
{
    ending = true;
    for (UnfinishedFile::Entry* entry = entries.load(); entry; entry = entry->next)
        if (entry->state == UnfinishedFile::Entry::Named) ::unlink(entry->name);
}

}  // namespace rapid

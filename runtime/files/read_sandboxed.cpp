#include "runtime/files/read_sandboxed.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <limits>
#include <new>

#include "runtime/base/memory_budget.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/file_error.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

// Limits for reading a file: what the libraries need for any file, plus a multiple of its bytes (a compressed file may
// unpack to many times its size).
struct Limits {
    std::size_t memory;  // bytes
    bool is_of_budget;   // memory comes from the budget, so exceeding it does not mean that the file is damaged
    unsigned seconds;    // of processor time
};

Limits limits_of(std::size_t file_bytes, std::size_t max_memory)
{
    constexpr std::size_t base = std::size_t{1} << 30, factor = 64, bytes_per_second = 2'000'000;
    constexpr unsigned base_seconds = 5;
    const std::size_t memory = base + factor * file_bytes;
    return {std::min(memory, max_memory), max_memory < memory,
            base_seconds + static_cast<unsigned>(file_bytes / bytes_per_second)};
}

enum class Outcome : std::uint32_t { None, Read, Refused, OutOfMemory };

struct Header {
    Outcome outcome;
    std::size_t bytes;                  // of the message
    ErrorKind kind = ErrorKind::Fault;  // of the refused file
};

std::function<void()>& further_limits()
{
    static std::function<void()> limits;
    return limits;
}

// Memory shared by both processes. Untouched pages cost nothing.
class SharedMemory {
public:
    explicit SharedMemory(std::size_t bytes) : bytes_(bytes)
    {
        // Some systems refuse to reserve more than they have.
        constexpr std::size_t least = std::size_t{64} << 20;
        do start_ = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        while (start_ == MAP_FAILED && errno == ENOMEM && (bytes_ /= 2) >= least);
        if (start_ == MAP_FAILED) throw file_error("can't be read: there is no shared memory", errno);
    }
    ~SharedMemory() { ::munmap(start_, bytes_); }
    SharedMemory(const SharedMemory&) = delete;
    SharedMemory& operator=(const SharedMemory&) = delete;

    Header& header() const { return *static_cast<Header*>(start_); }
    // Returns all the space after the header.
    std::span<unsigned char> message() const
    {
        return {static_cast<unsigned char*>(start_) + sizeof(Header), bytes_ - sizeof(Header)};
    }

private:
    void* start_;
    std::size_t bytes_;
};

void limit(__rlimit_resource resource, rlim_t most)
{
    rlimit value;
    if (::getrlimit(resource, &value) != 0) ::_exit(1);
    value.rlim_cur = std::min(value.rlim_max, most);
    // If both limits are equal, exceeding the processor limit raises SIGKILL, which does not reveal the limit.
    value.rlim_max = std::min(value.rlim_max, resource == RLIMIT_CPU ? most + 1 : most);
    if (::setrlimit(resource, &value) != 0) ::_exit(1);
}

// Returns the address space of this process, with which the copy starts: the smallest limit at which a page can still
// be mapped. /proc reports it too, but may be inaccessible (Landlock).
std::size_t address_space()
{
    // Touches the stack first, because a stack that grows under a low limit would end the process.
    volatile char room[1 << 14];
    for (std::size_t i = 0; i < sizeof room; i += 1 << 10) room[i] = 0;

    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    rlimit value;
    if (::getrlimit(RLIMIT_AS, &value) != 0) ::_exit(1);
    std::size_t low = 0, high = std::min<std::size_t>(value.rlim_max, std::size_t{1} << 47);
    while (high - low > page) {
        value.rlim_cur = low + (high - low) / 2;
        if (::setrlimit(RLIMIT_AS, &value) != 0) ::_exit(1);
        void* const mapped = ::mmap(nullptr, page, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        (mapped == MAP_FAILED ? low : high) = value.rlim_cur;
        if (mapped != MAP_FAILED) ::munmap(mapped, page);
    }
    return high;
}

// A reader that waits for a lock or a disk uses no processor time. It ends when it has used hardly any in two
// consecutive intervals. A single interval may pass while everything is stopped (SIGSTOP), and on a busy machine a
// working reader may take many.
constexpr unsigned interval = 15;           // s
constexpr double least_in_interval = 0.01;  // s: 1/1500 of a processor
constexpr int status_of_waiting = 3;

void end_where_it_waits(int)
{
    static double before = 0;
    static bool waited = false;
    timespec t;
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    const double now = static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    const bool waits = now - before < least_in_interval;
    if (waits && waited) ::_exit(status_of_waiting);
    before = now;
    waited = waits;
}

void confine(pid_t parent, const Limits& limits)
{
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);  // the parent ended before the line above
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU, SIGTERM}) ::signal(signal, SIG_DFL);
    ::signal(SIGALRM, end_where_it_waits);
    sigset_t none;
    ::sigemptyset(&none);
    ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
    // Nobody reads the libraries' last output.
    const int null_device = ::open("/dev/null", O_WRONLY);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(null_device, stream);
    // Closes inherited descriptors, through which a misbehaving process could reach others.
    ::close_range(STDERR_FILENO + 1, ~0U, 0);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, limits.seconds);
    const itimerval timer{{interval, 0}, {interval, 0}};
    if (::setitimer(ITIMER_REAL, &timer, nullptr) != 0) ::_exit(1);
    limit(RLIMIT_AS, address_space() + limits.memory);
}

Header outcome_of(const std::function<void(MessageWriter&)>& read, const SharedMemory& shared)
{
    const auto refused = [&](const char* why, ErrorKind kind = ErrorKind::Fault) {
        MessageWriter writer(shared.message());
        writer.put_text(why);
        return Header{Outcome::Refused, writer.bytes(), kind};
    };
    try {
        MessageWriter writer(shared.message());
        read(writer);
        return {Outcome::Read, writer.bytes()};
    } catch (const std::bad_alloc&) {
        return {Outcome::OutOfMemory, 0};
    } catch (const Error& error) {
        return refused(error.what(), error.kind());
    } catch (const std::exception& error) {
        return refused(error.what());
    } catch (...) {
        return refused("can't be read");
    }
}

std::string text_of_end(int status, const Limits& limits)
{
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        return fmt::format("takes longer than {} s to read", limits.seconds);
    if (WIFSIGNALED(status))
        return fmt::format("crashed the reader with signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
    return "crashed the reader";
}

Error beyond_limit(const Limits& limits)
{
    if (limits.is_of_budget)
        return Error(
            fmt::format("can't be read: the reader needs more than the available {}; read a smaller file, or set {}",
                        memory_text(static_cast<double>(limits.memory)), name_of(Setting::Memory)),
            ErrorKind::OutOfMemory);
    return Error(
        fmt::format("can't be read: it needs more than {} MB of memory, so it must be damaged", limits.memory >> 20));
}

}  // namespace

void confine_copies(std::function<void()> further) { further_limits() = std::move(further); }

std::size_t memory_of_copy()
{
    if (!is_memory_limited()) return std::numeric_limits<std::size_t>::max();
    return std::max(negligible_memory, free_memory() / 2);
}

void read_in_copy(const std::filesystem::path& path, const std::function<void(MessageWriter&)>& read,
                  const std::function<void(MessageReader&)>& receive, std::size_t max_memory)
{
    const Limits limits = limits_of(check_readable(path), max_memory);
    const SharedMemory shared(limits.memory);
    // The copy has only one thread. In an arena without workers TBB requests no others and takes no lock that a thread
    // missing in the copy may hold.
    tbb::task_arena alone(1);
    alone.initialize();
    const pid_t parent = ::getpid(), child = ::fork();
    if (child < 0) throw file_error("can't be read: the reader process can't be started", errno);
    if (child == 0) {
        confine(parent, limits);
        alone.execute([&] {
            shared.header() = outcome_of(
                [&](MessageWriter& message) {
                    if (further_limits()) further_limits()();
                    read(message);
                },
                shared);
            ::_exit(0);
        });
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const Header header = shared.header();  // the process may have failed, so this is untrusted
    const std::span<unsigned char> room = shared.message();
    MessageReader reader(room.first(std::min(header.bytes, room.size())));
    switch (header.outcome) {
        case Outcome::Read:
            return receive(reader);
        case Outcome::Refused:
            throw Error(reader.take_text(), header.kind);
        case Outcome::OutOfMemory:
            throw beyond_limit(limits);
        case Outcome::None:
            break;
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == status_of_waiting)
        throw Error(fmt::format("can't be read: the reader waited for {} s", 2 * interval));
    throw Error(fmt::format("can't be read: it {}, so it must be damaged", text_of_end(status, limits)));
}

}  // namespace rapid

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
#include <map>
#include <memory>
#include <mutex>
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

namespace {

std::map<std::string, NamedReader>& readers()
{
    static std::map<std::string, NamedReader> all;  // function-local: used during static initialisation
    return all;
}

void read_in_copy(const ReadRequest& request, const std::function<void(MessageReader&)>& receive,
                  std::size_t max_memory)
{
    const NamedReader& reader = readers().at(request.reader);
    rapid::read_in_copy(
        request.path, [&](MessageWriter& message) { reader(request, message); }, receive, max_memory);
}

// Writes all bytes. Returns false if the other end is closed.
bool put(int pipe, const void* from, std::size_t bytes)
{
    for (const char* at = static_cast<const char*>(from); bytes > 0;) {
        const ssize_t count = ::write(pipe, at, bytes);
        if (count < 0 && errno != EINTR) return false;
        if (count > 0) at += count, bytes -= static_cast<std::size_t>(count);
    }
    return true;
}

bool take(int pipe, void* to, std::size_t bytes)
{
    for (char* at = static_cast<char*>(to); bytes > 0;) {
        const ssize_t count = ::read(pipe, at, bytes);
        if (count == 0 || (count < 0 && errno != EINTR)) return false;
        if (count > 0) at += count, bytes -= static_cast<std::size_t>(count);
    }
    return true;
}

bool put_text(int pipe, const std::string& text)
{
    const std::size_t size = text.size();
    return put(pipe, &size, sizeof size) && put(pipe, text.data(), size);
}

bool take_text(int pipe, std::string& text)
{
    std::size_t size = 0;
    if (!take(pipe, &size, sizeof size)) return false;
    text.resize(size);
    return take(pipe, text.data(), size);
}

// The header of an answer: a message from the reader, or the text of an error.
struct AnswerHeader {
    bool refused;
    ErrorKind kind;  // if it is refused
    std::size_t bytes;
};

bool put_answer(int pipe, const AnswerHeader& header, const void* from)
{
    return put(pipe, &header, sizeof header) && put(pipe, from, header.bytes);
}

bool answer(int pipe, const ReadRequest& request, std::size_t max_memory)
{
    const auto refuse = [&](const std::string& why, ErrorKind kind) {
        return put_answer(pipe, {true, kind, why.size()}, why.data());
    };
    bool sent = false;
    try {
        read_in_copy(
            request,
            [&](MessageReader& message) {
                const std::span<const unsigned char> bytes = message.left();
                sent = put_answer(pipe, {false, ErrorKind::Fault, bytes.size()}, bytes.data());
            },
            max_memory);
        return sent;
    } catch (const Error& error) {
        return refuse(error.message(), error.kind());
    } catch (const std::exception& error) {
        return refuse(fmt::format("can't be read: {}", error.what()), ErrorKind::Fault);
    }
}

// A pipe between this process and the reader process.
struct Pipe {
    Descriptor read, write;

    Pipe()
    {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) throw file_error("the reader process has no pipe", errno);
        read = Descriptor(ends[0]), write = Descriptor(ends[1]);
        ::fcntl(ends[1], F_SETPIPE_SZ, 1 << 20);  // fewer switches between the two; some systems refuse it
    }
};

[[noreturn]] void serve(const Descriptor& requests, const Descriptor& answers)
{
    ReadRequest request;
    std::size_t max_memory = 0;  // budget of the requesting process
    while (take_text(requests.number(), request.reader) && take_text(requests.number(), request.path) &&
           take_text(requests.number(), request.what) && take(requests.number(), &max_memory, sizeof max_memory))
        if (!answer(answers.number(), request, max_memory)) break;
    ::_exit(0);
}

// Closes all inherited descriptors but these two.
void close_others(int first, int second)
{
    const int low = std::min(first, second), high = std::max(first, second);
    const auto close_from = [](int from, int to) {
        if (from <= to) ::close_range(static_cast<unsigned>(from), static_cast<unsigned>(to), 0);
    };
    close_from(STDERR_FILENO + 1, low - 1);
    close_from(low + 1, high - 1);
    ::close_range(static_cast<unsigned>(high) + 1, ~0U, 0);
}

class ReaderProcess {
public:
    explicit ReaderProcess(const std::function<void()>& confine)
    {
        Pipe requests, answers;
        const pid_t parent = ::getpid(), child = ::fork();
        if (child < 0) throw file_error("the reader process can't be started", errno);
        if (child == 0) begin(parent, requests.read, answers.write, confine);
        requests_ = std::move(requests.write);
        answers_ = std::move(answers.read);
        answers.write = Descriptor();  // closes this end, so that reading ends when the other process does
        std::string fault;
        if (!take_text(answers_.number(), fault)) fault = "the reader process ended";
        if (!fault.empty()) throw Error(fault);
    }

    void read(const ReadRequest& request, const std::function<void(MessageReader&)>& receive)
    {
        AnswerHeader header;
        std::unique_ptr<unsigned char[]> bytes;
        {
            const std::lock_guard lock(mutex_);
            const int to = requests_.number(), from = answers_.number();
            const std::size_t max_memory = memory_of_copy();
            if (!put_text(to, request.reader) || !put_text(to, request.path) || !put_text(to, request.what) ||
                !put(to, &max_memory, sizeof max_memory) || !take(from, &header, sizeof header))
                throw Error("can't be read: the reader process has ended");
            bytes = std::make_unique_for_overwrite<unsigned char[]>(header.bytes);
            if (!take(from, bytes.get(), header.bytes)) throw Error("can't be read: the reader process has ended");
        }
        const std::span<const unsigned char> message(bytes.get(), header.bytes);
        if (header.refused) throw Error(std::string(message.begin(), message.end()), header.kind);
        MessageReader reader(message);
        receive(reader);
    }

private:
    [[noreturn]] static void begin(pid_t parent, const Descriptor& requests, const Descriptor& answers,
                                   const std::function<void()>& confine)
    {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != parent) ::_exit(1);  // the parent ended before the line above
        // It ends exactly when the process that it serves ends.
        for (const int signal : {SIGINT, SIGQUIT, SIGHUP, SIGTERM}) ::signal(signal, SIG_IGN);
        close_others(requests.number(), answers.number());
        std::string fault;
        try {
            confine();
        } catch (const Error& error) {
            fault = error.message();
        }
        if (!put_text(answers.number(), fault) || !fault.empty()) ::_exit(1);
        serve(requests, answers);
    }

    std::mutex mutex_;
    Descriptor requests_, answers_;
};

std::unique_ptr<ReaderProcess>& process()
{
    static std::unique_ptr<ReaderProcess> one;
    return one;
}

}  // namespace

void define_reader(const std::string& name, NamedReader reader) { readers()[name] = std::move(reader); }

void start_reader_process(const std::function<void()>& confine)
{
    process() = std::make_unique<ReaderProcess>(confine);
}

void read_by_name(const ReadRequest& request, const std::function<void(MessageReader&)>& receive)
{
    if (process())
        process()->read(request, receive);
    else
        read_in_copy(request, receive, memory_of_copy());
}

}  // namespace rapid

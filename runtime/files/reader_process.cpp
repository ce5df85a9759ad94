#include "runtime/files/reader_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <map>
#include <memory>
#include <mutex>
#include <new>

#include "runtime/files/file_error.h"
#include "runtime/files/read_sandboxed.h"

namespace rapid {
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

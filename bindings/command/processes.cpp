#include "bindings/command/processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <memory>

#include "bindings/command_line/command.h"
#include "bindings/command_line/programs.h"
#include "bindings/command_line/signals.h"
#include "runtime/base/json.h"
#include "runtime/files/file_error.h"
#include "runtime/files/start_program.h"

namespace rapid {
namespace {

using json = CheckedJson;

void signal_at_end_of(int parent, int signal)
{
    prctl(PR_SET_PDEATHSIG, signal);
    if (getppid() != parent) _exit(status_failed);  // the parent ended before the line above
}

[[noreturn]] void become(const std::string& program, const std::vector<std::string>& words, int out, int errors)
{
    const int null = open("/dev/null", O_RDWR);
    dup2(null, STDIN_FILENO);
    dup2(out < 0 ? null : out, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    _exit(127);
}

pid_t checked_fork()
{
    const pid_t child = fork();
    if (child < 0) throw file_error("can't start a process", errno);
    return child;
}

int wait_for(pid_t child)
{
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
}

int code_of(int status) { return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status); }

// Describes how a process ended; empty for status 0.
std::string ending_of(int status)
{
    if (WIFSIGNALED(status)) return fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
    return WEXITSTATUS(status) == status_done ? "" : fmt::format("status {}", WEXITSTATUS(status));
}

// Captures the output of a process.
class Capture {
public:
    Capture() : file_(memfd_create("output", MFD_CLOEXEC))
    {
        if (!file_) throw file_error("not enough memory for the output of a process", errno);
    }
    int descriptor() const { return file_.number(); }
    // Returns the last bytes, without trailing newlines.
    std::string text(off_t most = std::numeric_limits<off_t>::max()) const
    {
        const off_t size = std::max<off_t>(lseek(file_.number(), 0, SEEK_END), 0);
        std::string text(static_cast<std::size_t>(std::min(size, most)), '\0');
        const ssize_t got = pread(file_.number(), text.data(), text.size(), size - static_cast<off_t>(text.size()));
        text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
        text.erase(text.find_last_not_of('\n') + 1);
        return text;
    }

private:
    Descriptor file_;
};

// Returns the result of a process. Its error is its last output; warnings come before.
EndedProcess ended_process(int status, const Capture& errors)
{
    std::string failure = ending_of(status), last = errors.text(4096);
    last.erase(0, last.rfind('\n') + 1);
    if (WIFSIGNALED(status))
        failure.insert(0, "ended by ");
    else if (!failure.empty())
        failure = last.empty() ? "ended with " + failure : last;
    return {failure, code_of(status)};
}

void write_event(int pipe, const json& event)
{
    const std::string line = json_text(event) + '\n';
    for (std::size_t written = 0; written < line.size();) {
        const ssize_t count = write(pipe, line.data() + written, line.size() - written);
        if (count < 0 && errno != EINTR) _exit(status_failed);
        if (count > 0) written += static_cast<std::size_t>(count);
    }
}

}  // namespace

int run_processes(std::size_t count, int jobs, const std::function<std::vector<std::string>(std::size_t)>& words,
                  const std::function<void(std::size_t, const EndedProcess&)>& ended)
{
    struct Running {
        std::size_t number;
        Capture errors;
    };
    sigset_t waited = ending_signals(), before;
    sigaddset(&waited, SIGCHLD);
    sigprocmask(SIG_BLOCK, &waited, &before);

    const std::string program = command_file();
    const pid_t parent = getpid();
    std::map<pid_t, Running> running;
    std::size_t next = 0;
    int ended_by = 0;
    const auto collect = [&] {
        for (auto one = running.begin(); one != running.end();) {
            int status = 0;
            if (waitpid(one->first, &status, WNOHANG) != one->first) {
                ++one;
                continue;
            }
            if (ended_by == 0) ended(one->second.number, ended_process(status, one->second.errors));
            one = running.erase(one);
        }
    };
    while (!running.empty() || (ended_by == 0 && next < count)) {
        while (ended_by == 0 && next < count && running.size() < static_cast<std::size_t>(jobs)) {
            const std::vector<std::string> arguments = words(next);
            Capture errors;
            const pid_t child = checked_fork();
            if (child == 0) {
                signal_at_end_of(parent, SIGTERM);
                sigprocmask(SIG_SETMASK, &before, nullptr);
                become(program, arguments, -1, errors.descriptor());
            }
            running.emplace(child, Running{next++, std::move(errors)});
        }
        const int signal = sigwaitinfo(&waited, nullptr);
        if (signal > 0 && signal != SIGCHLD) {
            ended_by = signal;
            for (const auto& [child, what] : running) kill(child, signal);
        }
        collect();
    }
    sigprocmask(SIG_SETMASK, &before, nullptr);
    return ended_by == 0 ? 0 : 128 + ended_by;
}

std::string run_in_child(const std::function<void(const ReportToParent& report)>& work,
                         const std::function<void(const json& event)>& on_event)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw file_error("can't make a pipe", errno);
    std::fflush(nullptr);
    const pid_t parent = getpid(), child = checked_fork();
    if (child == 0) {
        end_with_parent(parent);
        close(ends[0]);
        dup2(STDERR_FILENO, STDOUT_FILENO);
        work([&](const json& event) { write_event(ends[1], event); });
        std::fflush(nullptr);
        _exit(status_done);
    }

    close(ends[1]);
    const std::unique_ptr<std::FILE, decltype(&std::fclose)> pipe(fdopen(ends[0], "r"), &std::fclose);
    char* text = nullptr;
    std::size_t capacity = 0;
    while (getline(&text, &capacity, pipe.get()) > 0) {
        const json event = json::parse(text, nullptr, false);
        if (event.is_discarded()) break;  // truncated when the process ended
        on_event(event);
    }
    std::free(text);
    return ending_of(wait_for(child));
}

void end_with_parent(int parent) { signal_at_end_of(parent, SIGKILL); }

ProgramOutput output_of(const std::vector<std::string>& words)
{
    const Capture out, errors;
    const std::string program = program_path(words.front());
    const pid_t child = checked_fork();
    if (child == 0) become(program, words, out.descriptor(), errors.descriptor());
    return {code_of(wait_for(child)), out.text(), errors.text()};
}

}  // namespace rapid

#include "bindings/command/process_pool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <map>

#include "bindings/command_line/command.h"
#include "bindings/command_line/programs.h"
#include "bindings/command_line/signals.h"
#include "runtime/files/file_error.h"

namespace rapid {
namespace {

struct Running {
    std::size_t number;
    Descriptor errors;  // what it says on standard error
};

[[noreturn]] void become(const std::string& program, const std::vector<std::string>& words, int errors, pid_t parent,
                         const sigset_t& signals)
{
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(status_failed);  // it ended before the line above
    sigprocmask(SIG_SETMASK, &signals, nullptr);
    const int null = open("/dev/null", O_RDWR);
    dup2(null, STDIN_FILENO);
    dup2(null, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    _exit(127);
}

// The last error that a process printed: it ends with it. Warnings come before.
std::string last_error(int descriptor)
{
    constexpr off_t most = 4096;
    const off_t size = lseek(descriptor, 0, SEEK_END);
    std::string text(static_cast<std::size_t>(std::clamp<off_t>(size, 0, most)), '\0');
    const ssize_t got = pread(descriptor, text.data(), text.size(), size - static_cast<off_t>(text.size()));
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    while (!text.empty() && text.back() == '\n') text.pop_back();
    const std::size_t line = text.rfind('\n');
    return line == std::string::npos ? text : text.substr(line + 1);
}

EndedProcess ending_of(int status, int errors)
{
    if (WIFSIGNALED(status))
        return {fmt::format("ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status))),
                128 + WTERMSIG(status)};
    if (WEXITSTATUS(status) == status_done) return {};
    std::string failure = last_error(errors);
    if (failure.empty()) failure = fmt::format("ended with status {}", WEXITSTATUS(status));
    return {std::move(failure), WEXITSTATUS(status)};
}

}  // namespace

int run_processes(std::size_t count, int jobs, const std::function<std::vector<std::string>(std::size_t)>& words,
                  const std::function<void(std::size_t, const EndedProcess&)>& ended)
{
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
            if (ended_by == 0) ended(one->second.number, ending_of(status, one->second.errors.number()));
            one = running.erase(one);
        }
    };
    while (!running.empty() || (ended_by == 0 && next < count)) {
        while (ended_by == 0 && next < count && running.size() < static_cast<std::size_t>(jobs)) {
            const std::vector<std::string> arguments = words(next);
            Descriptor errors(memfd_create("errors", MFD_CLOEXEC));
            if (!errors) throw file_error("no memory for what a process says", errno);
            const pid_t child = fork();
            if (child < 0) throw file_error("no process", errno);
            if (child == 0) become(program, arguments, errors.number(), parent, before);
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

}  // namespace rapid

#include "bindings/command/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "bindings/command_line/command.h"

namespace rapid {

using nlohmann::json;

void end_with_parent(int parent)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(status_failed);  // it ended before the line above
}

std::string run_in_child(const std::function<void(const TellParent& tell)>& work,
                         const std::function<void(const json& event)>& hear)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe: {}", std::strerror(errno)));
    std::fflush(nullptr);
    const pid_t parent = getpid(), child = fork();
    if (child < 0) throw Error(fmt::format("no process: {}", std::strerror(errno)));
    if (child == 0) {
        end_with_parent(parent);
        close(ends[0]);
        dup2(STDERR_FILENO, STDOUT_FILENO);
        work([&](const json& event) {
            const std::string line = event.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
            for (std::size_t written = 0; written < line.size();) {
                const ssize_t count = write(ends[1], line.data() + written, line.size() - written);
                if (count < 0 && errno != EINTR) _exit(status_failed);
                if (count > 0) written += static_cast<std::size_t>(count);
            }
        });
        std::fflush(nullptr);
        _exit(status_done);
    }

    close(ends[1]);
    const std::unique_ptr<std::FILE, decltype(&std::fclose)> pipe(fdopen(ends[0], "r"), &std::fclose);
    char* text = nullptr;
    std::size_t capacity = 0;
    while (getline(&text, &capacity, pipe.get()) > 0) {
        const json event = json::parse(text, nullptr, false);
        if (event.is_discarded()) break;  // cut off with the process
        hear(event);
    }
    std::free(text);

    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFSIGNALED(status)) return fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
    if (WEXITSTATUS(status) != status_done) return fmt::format("status {}", WEXITSTATUS(status));
    return "";
}

}  // namespace rapid

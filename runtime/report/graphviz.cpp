#include "runtime/report/graphviz.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/files/file_error.h"
#include "runtime/files/start_program.h"

namespace rapid {
namespace {

// Returns a file in memory: unlike a pipe it never blocks dot.
Descriptor memory_file()
{
    Descriptor file(memfd_create("dot", MFD_CLOEXEC));
    if (!file) throw Error(fmt::format("not enough memory for dot: {}", std::strerror(errno)));
    return file;
}

void write_all(const Descriptor& file, const std::string& text)
{
    for (std::size_t written = 0; written < text.size();) {
        const ssize_t count =
            pwrite(file.number(), text.data() + written, text.size() - written, static_cast<off_t>(written));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) throw Error(fmt::format("not enough memory for dot: {}", std::strerror(errno)));
        written += static_cast<std::size_t>(count);
    }
}

std::string read_all(const Descriptor& file)
{
    std::string text;
    char part[65536];
    while (true) {
        const ssize_t count = pread(file.number(), part, sizeof part, static_cast<off_t>(text.size()));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return text;
        text.append(part, static_cast<std::size_t>(count));
    }
}

}  // namespace

std::string lay_out(const std::string& graph, const std::string& format)
{
    const Descriptor input = memory_file(), output = memory_file(), messages = memory_file();
    write_all(input, graph);

    const std::string program = program_path("dot");
    if (program.empty()) throw Error("the layout needs dot; install it (apt install graphviz), or write .dot");

    const pid_t dot = start_program(
        program, {"dot", "-T" + format},
        {{input.number(), STDIN_FILENO}, {output.number(), STDOUT_FILENO}, {messages.number(), STDERR_FILENO}});
    const int status = wait_for_program(dot);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw Error(fmt::format("dot failed: {}", read_all(messages)));
    return read_all(output);
}

}  // namespace rapid

#include "bindings/command/slurm.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <set>
#include <sstream>

#include "bindings/command_line/command.h"
#include "runtime/files/file_error.h"
#include "runtime/files/program_path.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

struct Output {
    int status;
    std::string out, errors;
};

std::string text_in(int descriptor)
{
    std::string text(static_cast<std::size_t>(std::max<off_t>(0, lseek(descriptor, 0, SEEK_END))), '\0');
    const ssize_t got = pread(descriptor, text.data(), text.size(), 0);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return text;
}

Output output_of(const std::vector<std::string>& words)
{
    const Descriptor out(memfd_create("out", MFD_CLOEXEC)), errors(memfd_create("errors", MFD_CLOEXEC));
    if (!out || !errors) throw file_error("no memory for what a process says", errno);
    const std::string program = program_path(words.front());
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const pid_t child = fork();
    if (child < 0) throw file_error("no process", errno);
    if (child == 0) {
        dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
        dup2(out.number(), STDOUT_FILENO);
        dup2(errors.number(), STDERR_FILENO);
        execv(program.c_str(), arguments.data());
        _exit(127);
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text_in(out.number()),
            text_in(errors.number())};
}

// Its standard output. Error: what it says where it fails.
std::string said_by(const std::vector<std::string>& words)
{
    const Output output = output_of(words);
    if (output.status == 0) return output.out;
    std::string text = output.errors;
    while (!text.empty() && text.back() == '\n') text.pop_back();
    throw Error(fmt::format("{} failed with status {}: {}", words.front(), output.status, text));
}

std::int64_t submit(const FarmJob& job, const fs::path& script, std::vector<std::string> words)
{
    words.insert(words.begin(), {"sbatch", "--parsable"});
    words.insert(words.end(), job.options.begin(), job.options.end());
    words.push_back(script.string());
    const std::string said = said_by(words);  // "17", or "17;CLUSTER"
    std::int64_t id = 0;
    const auto parsed = std::from_chars(said.data(), said.data() + said.size(), id);
    if (parsed.ec != std::errc() || id <= 0) throw Error(fmt::format("sbatch told no id of a job but \"{}\"", said));
    return id;
}

std::string list_of_jobs(const std::vector<std::int64_t>& jobs)
{
    const std::set<std::int64_t> each(jobs.begin(), jobs.end());
    return fmt::format("{}", fmt::join(each, ","));
}

}  // namespace

void require_slurm()
{
    std::vector<std::string> missing;
    for (const char* program : {"sbatch", "squeue", "scancel"})
        if (program_path(program).empty()) missing.emplace_back(program);
    if (!missing.empty())
        throw Error(
            fmt::format("--farm slurm: {} {} not on PATH; install slurm-client, or give --dry-run to see the "
                        "scripts",
                        fmt::join(missing, " and "), missing.size() == 1 ? "is" : "are"));
}

std::string ranges_of(const std::vector<std::size_t>& numbers)
{
    std::vector<std::string> ranges;
    for (std::size_t begin = 0, end = 1; begin < numbers.size(); begin = end++) {
        while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
        ranges.push_back(end == begin + 1 ? fmt::format("{}", numbers[begin])
                                          : fmt::format("{}-{}", numbers[begin], numbers[end - 1]));
    }
    return fmt::format("{}", fmt::join(ranges, ","));
}

std::int64_t submit_tasks(const FarmJob& job, const std::vector<std::size_t>& tasks)
{
    return submit(job, job.scripts() / "tasks.sh", {"--array=" + ranges_of(tasks)});
}

std::int64_t submit_last(const FarmJob& job, const std::vector<std::string>& waits_for)
{
    std::vector<std::string> words;
    if (!waits_for.empty())
        words.push_back(
            fmt::format("--dependency={}:{}", job.last_needs_all ? "afterok" : "afterany", fmt::join(waits_for, ":")));
    return submit(job, job.scripts() / "last.sh", std::move(words));
}

Queue queued(const std::vector<std::int64_t>& jobs)
{
    Queue queue;
    std::vector<std::int64_t> known;
    for (const std::int64_t job : jobs)
        if (job > 0) known.push_back(job);
    if (known.empty()) return queue;
    // Of a job that Slurm has forgotten squeue complains; it is not queued.
    const Output output =
        output_of({"squeue", "--noheader", "--array", "--format=%F|%K|%T|%r", "--jobs", list_of_jobs(known)});
    if (output.status != 0 && output.errors.find("Invalid job id") == std::string::npos)
        throw Error(fmt::format("squeue failed with status {}: {}", output.status, output.errors));
    std::istringstream lines(output.out);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream fields(line);
        std::string job, task, state, reason;
        std::getline(fields, job, '|');
        std::getline(fields, task, '|');
        std::getline(fields, state, '|');
        std::getline(fields, reason, '|');
        std::int64_t id = 0;
        std::size_t number = 0;
        std::from_chars(job.data(), job.data() + job.size(), id);
        std::from_chars(task.data(), task.data() + task.size(), number);  // "N/A" of one that is in no array
        queue[{id, number}] = {state, reason};
    }
    return queue;
}

void cancel(const std::vector<std::int64_t>& jobs)
{
    std::vector<std::string> words = {"scancel"};
    const std::set<std::int64_t> each(jobs.begin(), jobs.end());
    for (const std::int64_t job : each)
        if (job > 0) words.push_back(fmt::format("{}", job));
    if (words.size() > 1) said_by(words);
}

}  // namespace rapid

// rapid test: script-level tests. Each file runs in a process of its own, so that one that crashes, hangs in a script
// or ends the process is one failure, and the others run.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "bindings/commands/child.h"
#include "bindings/commands/command.h"
#include "bindings/test_host.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Where a child finds the pipe to tell its parent of the tests: a JSON object a line.
constexpr int report_descriptor = 3;

struct Counts {
    int passed = 0, failed = 0, skipped = 0, broken = 0;
};

// test_*.lua below a folder, in order of path; any other file as it is.
std::vector<fs::path> find_tests(const std::vector<std::string>& arguments)
{
    std::vector<fs::path> files;
    for (const std::string& argument : arguments) {
        if (!fs::exists(argument)) throw Error("no such file or folder").at({argument, 0});
        if (!fs::is_directory(argument)) {
            files.emplace_back(argument);
            continue;
        }
        std::vector<fs::path> found;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(argument)) {
            const std::string name = entry.path().filename().string();
            if (entry.is_regular_file() && name.starts_with("test_") && name.ends_with(".lua"))
                found.push_back(entry.path());
        }
        if (found.empty()) throw Error("no tests in this folder; their files are called test_*.lua").at({argument, 0});
        std::sort(found.begin(), found.end());
        files.insert(files.end(), found.begin(), found.end());
    }
    return files;
}

std::string indented(std::string text)
{
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; ++at) text.replace(at, 1, "\n  ");
    return "  " + text + '\n';
}

// The child: runs the tests of one file and tells of each.
int run_child(const std::string& file, const TestOptions& options)
{
    const auto send = [](const json& event) {
        const std::string line = event.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
        if (write(report_descriptor, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
            _exit(status_failed);
    };
    run_test_file(file, options, [&](const TestEvent& event) {
        std::fflush(stdout);
        send({{"kind", event.kind}, {"name", event.name}, {"message", event.message}});
    });
    send({{"end", true}});
    return status_done;
}

class Test : public Command {
public:
    std::string name() const override { return "test"; }
    std::string doc() const override { return "runs script-level tests"; }

    void declare(CLI::App& app) override
    {
        app.add_option("FILES", files_, "test files, or folders of test_*.lua")->type_name("")->required();
        app.add_option("--filter", filter_, "only tests whose name this Lua pattern matches")->type_name("PATTERN");
        // Our own: the process of one file.
        app.add_option("--child-of", parent_)->group("");
        app.add_option("--already-run", already_run_)->group("");
    }

    int run(const CommonOptions& common) override
    {
        if (parent_) {
            end_with_parent(*parent_);
            return run_child(files_.front(), options(common));
        }

        const std::string program = fs::read_symlink("/proc/self/exe").string();
        setenv("RAPID_BIN", program.c_str(), 0);  // for tests of the command itself
        Counts counts;
        for (const fs::path& file : find_tests(files_)) run_file(program, file, common, counts);
        if (counts.broken == 0 && counts.passed + counts.failed + counts.skipped == 0)
            throw Error(filter_.empty() ? "no tests were found; a file needs describe and it"
                                        : fmt::format("no test has a name that matches \"{}\"", filter_));
        print(fmt::format("{} passed, {} failed, {} skipped\n", counts.passed, counts.failed, counts.skipped));
        return counts.broken > 0 ? status_refused : counts.failed > 0 ? status_failed : status_done;
    }

private:
    TestOptions options(const CommonOptions& common) const
    {
        return {filter_, already_run_, common.threads, [](const std::string& message) {
                    print_error(Error(message), false);
                    _exit(status_failed);
                }};
    }

    // After a test that ended its process, the file goes on behind that test.
    void run_file(const std::string& program, const fs::path& file, const CommonOptions& common, Counts& counts) const
    {
        int already_run = 0;
        while (true) {
            const Ending ending = run_process(program, file, common, already_run, counts);
            if (ending.orderly) return;
            // Its own words, if it had any, are on standard error already.
            if (ending.running.empty()) {
                ++counts.broken;
                print(fmt::format("BROKEN {}\n{}", file.string(), indented("the tests ended with " + ending.how)));
                return;
            }
            ++counts.failed;
            print(fmt::format(
                "FAILED {}\n{}", ending.running,
                indented(fmt::format("{}: the test ended the process with {}", file.string(), ending.how))));
            already_run += ending.started;
        }
    }

    struct Ending {
        bool orderly;
        std::string how;      // where it is not: "signal 9 (Killed)"
        std::string running;  // the test that was running then
        int started;          // tests, in this process
    };
    Ending run_process(const std::string& program, const fs::path& file, const CommonOptions& common, int already_run,
                       Counts& counts) const
    {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe: {}", std::strerror(errno)));
        const pid_t child = spawn(program, file, common, already_run, ends[1]);
        close(ends[1]);
        Ending ending = follow(ends[0], common.verbose, counts);
        int status = 0;
        waitpid(child, &status, 0);
        ending.orderly = ending.orderly && WIFEXITED(status) && WEXITSTATUS(status) == status_done;
        ending.how = WIFSIGNALED(status) ? fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                         : fmt::format("status {}", WEXITSTATUS(status));
        return ending;
    }

    pid_t spawn(const std::string& program, const fs::path& file, const CommonOptions& common, int already_run,
                int report) const
    {
        std::vector<std::string> words = {"rapid", "test", fmt::format("--child-of={}", getpid()),
                                          fmt::format("--already-run={}", already_run),
                                          fmt::format("--threads={}", common.threads)};
        if (!filter_.empty()) words.push_back("--filter=" + filter_);
        words.insert(words.end(), {"--", file.string()});
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);

        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, report, report_descriptor);
        pid_t child = 0;
        std::fflush(stdout);
        const int error = posix_spawn(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        if (error != 0) throw Error(fmt::format("can't be started: {}", std::strerror(error))).at({program, 0});
        return child;
    }

    // Reads what the child tells, to its end.
    static Ending follow(int descriptor, bool verbose, Counts& counts)
    {
        const std::unique_ptr<std::FILE, decltype(&std::fclose)> pipe(fdopen(descriptor, "r"), &std::fclose);
        Ending ending{false, "", "", 0};
        char* text = nullptr;
        std::size_t capacity = 0;
        while (getline(&text, &capacity, pipe.get()) > 0) {
            const json event = json::parse(text, nullptr, false);
            if (event.is_discarded()) break;  // cut off with the process
            ending.orderly = event.contains("end");
            if (ending.orderly) break;
            const bool starts = event.at("kind").get<TestEvent::Kind>() == TestEvent::Started;
            ending.running = starts ? event.at("name").get<std::string>() : "";
            ending.started += starts;
            count(event, verbose, counts);
        }
        std::free(text);
        return ending;
    }

    static void count(const json& event, bool verbose, Counts& counts)
    {
        const std::string name = event.at("name");
        const auto kind = event.at("kind").get<TestEvent::Kind>();
        const auto tell = [&](const char* what) {
            print(fmt::format("{} {}\n{}", what, name, indented(event.at("message"))));
        };
        switch (kind) {
            case TestEvent::Started:
                break;
            case TestEvent::Passed:
                ++counts.passed;
                if (verbose) print(fmt::format("passed {}\n", name));
                break;
            case TestEvent::Skipped:
                ++counts.skipped;
                if (verbose) print(fmt::format("skipped {}\n", name));
                break;
            case TestEvent::Failed:
                ++counts.failed, tell("FAILED");
                break;
            case TestEvent::Broken:
                ++counts.broken, tell("BROKEN");
                break;
        }
    }

    std::vector<std::string> files_;
    std::string filter_;
    std::optional<pid_t> parent_;
    int already_run_ = 0;
};
RAPID_COMMAND(Test);

}  // namespace
}  // namespace rapid

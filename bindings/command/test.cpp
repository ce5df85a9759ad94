// rapid test: script-level tests. Each file runs in a child process, so that one that crashes, hangs in a script or
// ends its process is one failure, and the others run.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "bindings/command/child.h"
#include "bindings/command/command.h"
#include "bindings/command/or_throw.h"
#include "bindings/command/test_report.h"
#include "bindings/command/untrusted.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A child's end of the pipe on which it tells its parent of the tests: one JSON object per line.
constexpr int report_descriptor = 3;

// test_*.lua below a folder, sorted by path; any other file as it is.
std::vector<fs::path> find_tests(const std::vector<std::string>& arguments)
{
    std::vector<fs::path> files;
    for (const std::string& argument : arguments) {
        std::error_code none;
        if (!fs::exists(argument, none)) throw Error("no such file or folder").at({argument, 0});
        if (!fs::is_directory(argument)) {
            // Each process of a file reads it again, and a pipe would be waited for.
            if (!fs::is_regular_file(argument)) throw Error("it is not a regular file").at({argument, 0});
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

// The child: runs the tests of one file and reports each.
int run_child(const std::string& file, const SceneTestOptions& options)
{
    const auto send = [](const json& event) {
        const std::string line = event.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
        if (write(report_descriptor, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
            _exit(status_failed);
    };
    or_throw(run_scene_tests(file, options, [&](const SceneTestEvent& event) {
        std::fflush(stdout);
        send({{"kind", event.kind}, {"name", event.name}, {"message", event.message}});
    }));
    send({{"end", true}});
    return status_done;
}

class Test : public Command, public Confined {
public:
    std::string name() const override { return "test"; }
    std::string doc() const override { return "runs script-level tests"; }

    void declare(CLI::App& app) override
    {
        app.add_option("FILES", files_, "test files, or folders of test_*.lua")->type_name("")->required();
        app.add_option("--filter", filter_, "only tests whose name this Lua pattern matches")->type_name("PATTERN");
        app.add_option("--format", format_, "what is printed: text, tap or junit")
            ->type_name("")
            ->check(CLI::IsMember(
                std::vector<std::string>(std::begin(TestReport::formats), std::end(TestReport::formats))));
        untrusted_.declare(app, "test");
        // Internal: the process of one file.
        app.add_option("--child-of", parent_)->group("");
        app.add_option("--already-run", already_run_)->group("");
    }

    // The processes that run the files are sandboxed; this one runs no script and no plugin.
    void confine(const CommonOptions& common) override
    {
        if (!parent_) return;
        const auto access = [&] { return SandboxAccess{{folder_of(files_.front())}, {}, report_descriptor + 1}; };
        untrusted_.confine(access, common);
    }
    bool takes_plugins() const override { return parent_.has_value(); }

    int run(const CommonOptions& common) override
    {
        if (parent_) {
            end_with_parent(*parent_);
            return run_child(files_.front(), options(common));
        }

        const std::string program = fs::read_symlink("/proc/self/exe").string();
        setenv("RAPID_BIN", program.c_str(), 0);  // for tests of the command itself
        const std::vector<fs::path> files = find_tests(files_);
        report_ = TestReport::make(format_, common.verbose);
        for (const fs::path& file : files) run_file(program, file, common);
        const TestCounts& counts = counts_;
        if (counts.broken == 0 && counts.passed + counts.failed + counts.skipped == 0)
            throw Error(filter_.empty() ? "no tests were found; a file needs describe and it"
                                        : fmt::format("no test has a name that matches \"{}\"", filter_));
        report_->end(counts);
        return counts.broken > 0 ? status_refused : counts.failed > 0 ? status_failed : status_done;
    }

private:
    SceneTestOptions options(const CommonOptions& common) const
    {
        return {filter_, already_run_, common.threads, [](const std::string& message) {
                    print_error(Error(message), false);
                    _exit(status_failed);
                }};
    }

    // If a test ends its process, a new process goes on with the next test of the file.
    void run_file(const std::string& program, const fs::path& file, const CommonOptions& common)
    {
        int already_run = 0;
        while (true) {
            const Ending ending = run_process(program, file, common, already_run);
            if (ending.orderly) return;
            // Its message, if any, is on standard error already.
            if (ending.running.empty())
                return add({SceneTestEvent::Broken, file.string(), "", "the tests ended with " + ending.how});
            add({SceneTestEvent::Failed, file.string(), ending.running,
                 fmt::format("{}: the test ended the process with {}", file.string(), ending.how)});
            already_run += ending.started;
        }
    }

    struct Ending {
        bool orderly;
        std::string how;      // if it did not end by itself: "signal 9 (Killed)"
        std::string running;  // the test that was running then
        int started;          // tests, in this process
    };
    Ending run_process(const std::string& program, const fs::path& file, const CommonOptions& common, int already_run)
    {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe: {}", std::strerror(errno)));
        const pid_t child = spawn(program, file, common, already_run, ends[1]);
        close(ends[1]);
        Ending ending = follow(ends[0], file.string());
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
        for (const std::string& plugin : common.plugins) words.push_back("--plugin=" + plugin);
        for (std::string& word : untrusted_.words()) words.push_back(std::move(word));
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

    // Reads the events of the child until it ends.
    Ending follow(int descriptor, const std::string& file)
    {
        const std::unique_ptr<std::FILE, decltype(&std::fclose)> pipe(fdopen(descriptor, "r"), &std::fclose);
        Ending ending{false, "", "", 0};
        char* text = nullptr;
        std::size_t capacity = 0;
        auto began = std::chrono::steady_clock::now();
        while (getline(&text, &capacity, pipe.get()) > 0) {
            const json event = json::parse(text, nullptr, false);
            if (event.is_discarded()) break;  // cut off with the process
            ending.orderly = event.contains("end");
            if (ending.orderly) break;
            const auto kind = event.at("kind").get<SceneTestEvent::Kind>();
            const std::string name = event.at("name");
            const auto now = std::chrono::steady_clock::now();
            ending.running = "";
            if (kind == SceneTestEvent::Started) {
                ending.running = name;
                ++ending.started;
            } else {
                add({kind, file, name, event.at("message"), std::chrono::duration<double>(now - began).count()});
            }
            began = now;
        }
        std::free(text);
        return ending;
    }

    void add(const TestResult& result)
    {
        counts_.add(result.kind);
        report_->add(result);
    }

    UntrustedOptions untrusted_;
    std::vector<std::string> files_;
    std::string filter_, format_ = "text";
    std::unique_ptr<TestReport> report_;
    TestCounts counts_;
    std::optional<pid_t> parent_;
    int already_run_ = 0;
};
RAPID_COMMAND(Test);

}  // namespace
}  // namespace rapid

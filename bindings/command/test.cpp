// rapid test: script-level tests. Files run in child processes, several at a time. The report has the order of the
// files.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "bindings/command/processes.h"
#include "bindings/command/test_file.h"
#include "bindings/command/test_report.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// Returns test_*.lua below a folder, sorted by path; any other file unchanged.
std::vector<fs::path> find_tests(const std::vector<std::string>& arguments)
{
    std::vector<fs::path> files;
    for (const std::string& argument : arguments) {
        std::error_code none;
        if (!fs::exists(argument, none)) throw Error("no such file or folder").at({argument, 0});
        if (!fs::is_directory(argument)) {
            // Each process of a file reads it again, and a pipe would block.
            if (!fs::is_regular_file(argument)) throw Error("is not a regular file").at({argument, 0});
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

class Test : public Command, public Confined {
public:
    std::string name() const override { return "test"; }
    std::string doc() const override { return "runs tests written in Lua"; }

    void declare(Options& options) override
    {
        options.add_option("FILES", files_, "test files, or folders of test_*.lua").type_name("").required();
        options.add_option("--filter", filter_, "only tests whose name matches this Lua pattern").type_name("PATTERN");
        options
            .add_option(
                "--jobs", [this](const std::string& text) { jobs_ = read_whole("--jobs", text, 1); },
                "number of files that run at the same time [default: the number of processors]")
            .type_name("N");
        options.add_option("--format", format_, "format of the report: text, tap or junit")
            .type_name("")
            .one_of({std::begin(TestReport::formats), std::end(TestReport::formats)});
        options
            .add_option(
                "--slowest", [this](const std::string& text) { slowest_ = read_whole("--slowest", text, 1); },
                "lists the N slowest tests with their seconds (text only)")
            .type_name("N");
        untrusted_.declare(options, "test");
        // Internal options, for the process of one file.
        options.add_option("--child-of", parent_).internal();
        options.add_option("--already-run", already_run_).internal();
    }

    // The processes that run the files are sandboxed; this one runs no script and no plugin.
    void confine(const CommonOptions& common) override
    {
        if (!parent_) return;
        const auto access = [&] { return SandboxAccess{{folder_of(files_.front())}, {}, test_report_descriptor + 1}; };
        untrusted_.confine(access, common);
    }
    bool takes_plugins() const override { return parent_.has_value(); }

    int run(const CommonOptions& common) override
    {
        if (parent_) {
            end_with_parent(*parent_);
            run_tests_as_child(files_.front(), options(common));
            return status_done;
        }

        const std::string program = fs::read_symlink("/proc/self/exe").string();
        setenv("RAPID_BIN", program.c_str(), 0);  // for tests of the command itself
        if (slowest_ > 0 && format_ != "text")
            throw Error(fmt::format("--slowest needs --format text, not {}", format_));
        report_ = TestReport::make(format_, common.verbose, static_cast<std::size_t>(slowest_));
        run_files(find_tests(files_), common);
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

    // Starts the files in order, and reports each as soon as those before it have ended.
    void run_files(const std::vector<fs::path>& files, const CommonOptions& common)
    {
        const auto processors = static_cast<std::int64_t>(std::max(1u, std::thread::hardware_concurrency()));
        const auto jobs = static_cast<std::size_t>(jobs_ > 0 ? jobs_ : processors);
        const std::vector<std::string> words = words_of_child(common);
        std::vector<std::unique_ptr<TestFile>> tests;  // null: reported
        std::vector<pollfd> running;
        for (std::size_t reported = 0; reported < files.size();) {
            running.clear();
            std::vector<TestFile*> files_of_running;
            for (std::size_t i = reported; i < files.size() && running.size() < jobs; ++i) {
                if (i == tests.size()) tests.push_back(std::make_unique<TestFile>(files[i], words, files.size() > 1));
                if (tests[i]->has_ended()) continue;
                running.push_back({tests[i]->descriptor(), POLLIN, 0});
                files_of_running.push_back(tests[i].get());
            }
            while (poll(running.data(), running.size(), -1) < 0 && errno == EINTR) {
            }
            for (std::size_t i = 0; i < running.size(); ++i)
                if (running[i].revents != 0) files_of_running[i]->receive();
            while (reported < tests.size()) {
                tests[reported]->take_results([this](const TestResult& result) { add(result); });
                if (!tests[reported]->has_ended()) break;
                tests[reported++].reset();
            }
        }
    }

    // Returns the arguments of a file's process, except those that differ between files.
    std::vector<std::string> words_of_child(const CommonOptions& common) const
    {
        std::vector<std::string> words = {"rapid", "test", fmt::format("--child-of={}", getpid()),
                                          fmt::format("--threads={}", common.threads)};
        if (!filter_.empty()) words.push_back("--filter=" + filter_);
        for (const std::string& plugin : common.plugins) words.push_back("--plugin=" + plugin);
        for (std::string& word : untrusted_.words()) words.push_back(std::move(word));
        return words;
    }

    void add(const TestResult& result)
    {
        counts_.add(result.kind);
        report_->add(result);
    }

    UntrustedOptions untrusted_;
    std::vector<std::string> files_;
    std::string filter_, format_ = "text";
    std::int64_t jobs_ = 0, slowest_ = 0;  // 0: not given
    std::unique_ptr<TestReport> report_;
    TestCounts counts_;
    std::optional<pid_t> parent_;
    int already_run_ = 0;
};
RAPID_COMMAND(Test);

}  // namespace
}  // namespace rapid

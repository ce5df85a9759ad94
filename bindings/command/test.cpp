// rapid test: script-level tests. Files run in child processes, several at a time. The report has the order of the
// files.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bindings/command/processes.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_tests.h"
#include "runtime/base/json.h"
#include "runtime/files/file_error.h"

namespace rapid {

// The output of `rapid test`: plain text, TAP 13 for test harnesses, or JUnit's XML for build servers.
struct TestResult {
    SceneTestEvent::Kind kind;  // not Started
    std::string file;
    std::string name;     // of the test; empty for a file that is Broken
    std::string message;  // of Failed and Broken
    double seconds = 0;
};

struct TestCounts {
    int passed = 0, failed = 0, skipped = 0, broken = 0;

    void add(SceneTestEvent::Kind kind);
};

class TestReport {
public:
    // verbose: reports tests that pass, too. slowest: that many tests are listed with their seconds, as text only.
    static std::unique_ptr<TestReport> make(const std::string& format, bool verbose, std::size_t slowest = 0);
    static constexpr const char* formats[] = {"text", "tap", "junit"};

    virtual ~TestReport() = default;
    virtual void add(const TestResult& result) = 0;
    virtual void end(const TestCounts& counts) = 0;
};

// A file of tests that `rapid test` runs in a child process, so that one that crashes, hangs in a script or ends its
// process is only one failure. If a test ends the process, a new one continues with the next test of the file.

// The child's end of the pipe on which it reports its tests.
inline constexpr int test_report_descriptor = 3;

class TestFile {
public:
    // Starts the process: this program with `words` and two words more, of which --already-run=N is the first and
    // the file the last. With `capture` its standard output and error are kept until take_results() prints them.
    TestFile(std::filesystem::path file, std::vector<std::string> words, bool capture);

    // Readable if receive() has something to do.
    int descriptor() const { return reports_.number(); }
    // Reads what the process has reported, and notices its end. Blocks if there is nothing.
    void receive();
    bool has_ended() const { return has_ended_; }

    // Passes on the results that were received since the last call, and prints the captured output that came before
    // each of them.
    void take_results(const std::function<void(const TestResult&)>& add);

private:
    // Output of the process on one of its standard streams.
    class Capture {
    public:
        void open();
        int descriptor() const { return file_.number(); }
        std::string take(off_t end);  // from the end of the last call
        std::string take_all();

    private:
        Descriptor file_;
        off_t taken_ = 0;
    };

    struct Received {
        std::optional<TestResult> result;  // none: the output after the last test
        std::string out, err;              // before the result
    };

    void start();
    void read_report(const std::string& line);
    void end_process();
    void end_file(std::optional<TestResult> result);

    std::filesystem::path file_;
    std::vector<std::string> words_;
    Capture out_, err_;
    std::deque<Received> received_;

    // State of the current process.
    pid_t child_ = 0;
    Descriptor reports_;
    std::string unread_;         // the beginning of a report
    std::string running_;        // the test that has started and not ended; empty: none
    int started_ = 0;            // tests, by this process and those before it
    bool all_reported_ = false;  // the process has nothing left to run
    bool has_ended_ = false;     // no process will follow
};

namespace {

// The text with a prefix before each line.
std::string prefixed(const std::string& prefix, std::string text)
{
    const std::string next = '\n' + prefix;
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += next.size())
        text.replace(at, 1, next);
    return prefix + text + '\n';
}

class TextReport : public TestReport {
public:
    TextReport(bool verbose, std::size_t slowest) : verbose_(verbose), slowest_(slowest) {}

    void add(const TestResult& result) override
    {
        const std::string& name = result.name.empty() ? result.file : result.name;
        if (result.kind == SceneTestEvent::Failed || result.kind == SceneTestEvent::Broken)
            print(fmt::format("{} {}\n{}", result.kind == SceneTestEvent::Failed ? "FAILED" : "BROKEN", name,
                              prefixed("  ", result.message)));
        else if (verbose_)
            print(fmt::format("{} {}\n", result.kind == SceneTestEvent::Passed ? "passed" : "skipped", name));
        if (slowest_ > 0) durations_.emplace_back(result.seconds, fmt::format("{} ({})", name, result.file));
    }

    void end(const TestCounts& counts) override
    {
        std::sort(durations_.begin(), durations_.end(), std::greater<>());
        durations_.resize(std::min(durations_.size(), slowest_));
        // The format is Catch2's.
        for (const auto& [seconds, name] : durations_) print(fmt::format("{:.3f} s: {}\n", seconds, name));
        print(fmt::format("{} passed, {} failed, {} skipped\n", counts.passed, counts.failed, counts.skipped));
    }

private:
    bool verbose_;
    std::size_t slowest_;
    std::vector<std::pair<double, std::string>> durations_;  // of all tests, if some are to be listed
};

// Test Anything Protocol, version 13: a line for each test as it ends, messages as comments, the plan last.
class TapReport : public TestReport {
public:
    TapReport() { print("TAP version 13\n"); }

    void add(const TestResult& result) override
    {
        std::string name;
        for (const char c : result.name.empty() ? result.file : result.name) {
            if (c == '#' || c == '\\') name += '\\';
            name += c == '\n' ? ' ' : c;
        }
        const bool ok = result.kind == SceneTestEvent::Passed || result.kind == SceneTestEvent::Skipped;
        print(fmt::format("{} {} - {}{}\n{}", ok ? "ok" : "not ok", ++number_, name,
                          result.kind == SceneTestEvent::Skipped ? " # SKIP" : "",
                          ok ? "" : prefixed("# ", result.message)));
    }

    void end(const TestCounts&) override { print(fmt::format("1..{}\n", number_)); }

private:
    int number_ = 0;
};

std::string xml(const std::string& text)
{
    std::string escaped;
    for (const char c : text) {
        switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            case '\n':
                escaped += "&#10;";
                break;
            default:  // XML has no other control characters, not even escaped
                escaped += static_cast<unsigned char>(c) < ' ' && c != '\t' ? '?' : c;
        }
    }
    return escaped;
}

// One suite per file. Its counts come before its tests, so it is printed when all tests have ended.
class JUnitReport : public TestReport {
public:
    void add(const TestResult& result) override
    {
        if (suites_.empty() || suites_.back().file != result.file) suites_.push_back({result.file, {}, 0, {}});
        Suite& suite = suites_.back();
        suite.counts.add(result.kind);
        suite.seconds += result.seconds;
        suite.cases += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"", xml(result.file),
                                   xml(result.name), result.seconds);
        if (result.kind == SceneTestEvent::Passed) {
            suite.cases += "/>\n";
            return;
        }
        const std::string first_line = result.message.substr(0, result.message.find('\n'));
        if (result.kind == SceneTestEvent::Skipped)
            suite.cases += ">\n      <skipped/>\n";
        else
            suite.cases += fmt::format(">\n      <{0} message=\"{1}\">{2}</{0}>\n",
                                       result.kind == SceneTestEvent::Failed ? "failure" : "error", xml(first_line),
                                       xml(result.message));
        suite.cases += "    </testcase>\n";
    }

    void end(const TestCounts& counts) override
    {
        double seconds = 0;
        for (const Suite& suite : suites_) seconds += suite.seconds;
        print(fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"rapid test\" {}>\n",
                          attributes(counts, seconds)));
        for (const Suite& suite : suites_)
            print(fmt::format("  <testsuite name=\"{}\" {}>\n{}  </testsuite>\n", xml(suite.file),
                              attributes(suite.counts, suite.seconds), suite.cases));
        print("</testsuites>\n");
    }

private:
    struct Suite {
        std::string file;
        TestCounts counts;
        double seconds;
        std::string cases;
    };

    static std::string attributes(const TestCounts& counts, double seconds)
    {
        return fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3f}\"",
                           counts.passed + counts.failed + counts.skipped + counts.broken, counts.failed, counts.broken,
                           counts.skipped, seconds);
    }

    std::vector<Suite> suites_;
};

}  // namespace

void TestCounts::add(SceneTestEvent::Kind kind)
{
    passed += kind == SceneTestEvent::Passed;
    failed += kind == SceneTestEvent::Failed;
    skipped += kind == SceneTestEvent::Skipped;
    broken += kind == SceneTestEvent::Broken;
}

std::unique_ptr<TestReport> TestReport::make(const std::string& format, bool verbose, std::size_t slowest)
{
    if (format == "tap") return std::make_unique<TapReport>();
    if (format == "junit") return std::make_unique<JUnitReport>();
    return std::make_unique<TextReport>(verbose, slowest);
}

// The child: runs the tests of a file in this process and reports each to the parent.
void run_tests_as_child(const std::string& file, const SceneTestOptions& options)
{
    fcntl(test_report_descriptor, F_SETFD, FD_CLOEXEC);  // otherwise programs started by tests would keep the pipe open
    const auto send = [](const CheckedJson& report) {
        const std::string line = json_text(report) + '\n';
        if (write(test_report_descriptor, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
            _exit(status_failed);
    };
    auto began = std::chrono::steady_clock::now();
    run_scene_tests(file, options, [&](const SceneTestEvent& event) {
        const auto now = std::chrono::steady_clock::now();
        std::fflush(stdout);
        send({{"kind", event.kind},
              {"name", event.name},
              {"message", event.message},
              {"seconds", std::chrono::duration<double>(now - began).count()},
              // The length of the captured output up to this event.
              {"out", lseek(STDOUT_FILENO, 0, SEEK_CUR)},
              {"err", lseek(STDERR_FILENO, 0, SEEK_CUR)}});
        began = now;
    }).value();
    send({{"end", true}});
}

void TestFile::Capture::open()
{
    file_ = Descriptor(memfd_create("output", MFD_CLOEXEC));
    if (!file_) throw file_error("not enough memory for the output of a test", errno);
}

std::string TestFile::Capture::take(off_t end)
{
    std::string text;
    if (!file_ || end <= taken_) return text;
    text.resize(static_cast<std::size_t>(end - taken_));
    const ssize_t got = pread(file_.number(), text.data(), text.size(), taken_);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    taken_ += static_cast<off_t>(text.size());
    return text;
}

std::string TestFile::Capture::take_all()
{
    struct stat status = {};
    if (!file_ || fstat(file_.number(), &status) != 0) return "";
    return take(status.st_size);
}

TestFile::TestFile(std::filesystem::path file, std::vector<std::string> words, bool capture)
    : file_(std::move(file)), words_(std::move(words))
{
    if (capture) {
        out_.open();
        err_.open();
    }
    start();
}

void TestFile::start()
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw file_error("can't make a pipe", errno);
    reports_ = Descriptor(ends[0]);
    const Descriptor childs_end(ends[1]);

    std::vector<std::string> words = words_;
    words.insert(words.end(), {fmt::format("--already-run={}", started_), "--", file_.string()});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    if (out_.descriptor() >= 0) {
        posix_spawn_file_actions_adddup2(&actions, out_.descriptor(), STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&actions, err_.descriptor(), STDERR_FILENO);
    }
    posix_spawn_file_actions_adddup2(&actions, childs_end.number(), test_report_descriptor);
    std::fflush(stdout);
    const int error = posix_spawn(&child_, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw file_error("can't start a process", error);
    unread_.clear();
    running_.clear();
    all_reported_ = false;
}

void TestFile::receive()
{
    char buffer[65536];
    ssize_t got = 0;
    do {
        got = read(reports_.number(), buffer, sizeof buffer);
    } while (got < 0 && errno == EINTR);
    if (got <= 0) return end_process();
    unread_.append(buffer, static_cast<std::size_t>(got));
    std::size_t line = 0;
    for (std::size_t end; (end = unread_.find('\n', line)) != std::string::npos; line = end + 1)
        read_report(unread_.substr(line, end - line));
    unread_.erase(0, line);
    if (all_reported_) end_process();
}

void TestFile::read_report(const std::string& line)
{
    const CheckedJson report = CheckedJson::parse(line, nullptr, false);
    if (report.is_discarded()) return;  // the test has written to the descriptor
    if (report.contains("end")) {
        all_reported_ = true;
        return;
    }
    const auto kind = report.at("kind").get<SceneTestEvent::Kind>();
    running_.clear();
    if (kind == SceneTestEvent::Started) {
        running_ = report.at("name");
        ++started_;
        return;
    }
    received_.push_back(
        {TestResult{kind, file_.string(), report.at("name"), report.at("message"), report.at("seconds")},
         out_.take(report.at("out")), err_.take(report.at("err"))});
}

void TestFile::end_process()
{
    reports_ = Descriptor();
    int status = 0;
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    if (all_reported_ && WIFEXITED(status) && WEXITSTATUS(status) == status_done) return end_file(std::nullopt);

    // The process has printed its reason, if any.
    const std::string how = WIFSIGNALED(status)
                                ? fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                : fmt::format("status {}", WEXITSTATUS(status));
    const std::string file = file_.string();
    if (running_.empty()) return end_file(TestResult{SceneTestEvent::Broken, file, "", "the tests ended with " + how});
    const std::string message = fmt::format("{}: the test ended the process with {}", file, how);
    received_.push_back(
        {TestResult{SceneTestEvent::Failed, file, running_, message}, out_.take_all(), err_.take_all()});
    start();
}

void TestFile::end_file(std::optional<TestResult> result)
{
    received_.push_back({std::move(result), out_.take_all(), err_.take_all()});
    has_ended_ = true;
    out_ = Capture();
    err_ = Capture();  // many files may wait for one before them
}

void TestFile::take_results(const std::function<void(const TestResult&)>& add)
{
    for (; !received_.empty(); received_.pop_front()) {
        const Received& next = received_.front();
        std::fwrite(next.out.data(), 1, next.out.size(), stdout);
        std::fwrite(next.err.data(), 1, next.err.size(), stderr);
        if (next.result) add(*next.result);
        std::fflush(stdout);  // long runs show failures as they occur
    }
}

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

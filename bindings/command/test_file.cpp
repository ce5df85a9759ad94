#include "bindings/command/test_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "bindings/command_line/command.h"
#include "runtime/base/json.h"

namespace rapid {

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

}  // namespace rapid

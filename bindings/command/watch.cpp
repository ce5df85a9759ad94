#include "bindings/command/watch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/inotify.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <vector>

#include "bindings/command_line/command.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr int report_descriptor = 3;  // in the child
constexpr int settle_time = 100;      // ms without a change: editors and exporters write several files in a row

sigset_t watched_signals()
{
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGCHLD}) sigaddset(&set, signal);
    return set;
}

int checked(int descriptor, const char* what)
{
    if (descriptor < 0) throw Error(fmt::format("--watch: can't make {}: {}", what, std::strerror(errno)));
    return descriptor;
}

// This process's command line with report_option added: a run that has it does not watch.
std::vector<std::string> arguments_of_run()
{
    std::ifstream file("/proc/self/cmdline", std::ios::binary);
    std::vector<std::string> words;
    for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
    words.insert(words.begin() + 1, Watch::report_option);
    return words;
}

fs::path whole_path(const fs::path& path) { return fs::absolute(path).lexically_normal(); }

}  // namespace

void Watch::report(const fs::path& file)
{
    const std::string line = whole_path(file).string() + '\n';
    [[maybe_unused]] const ssize_t ignored = write(report_descriptor, line.data(), line.size());  // it may have gone
}

Watch::Watch(fs::path graph, bool quiet)
    : graph_(std::move(graph)),
      quiet_(quiet),
      notify_(checked(inotify_init1(IN_CLOEXEC | IN_NONBLOCK), "inotify")),
      signals_([] {
          const sigset_t set = watched_signals();
          pthread_sigmask(SIG_BLOCK, &set, nullptr);
          return checked(signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK), "signalfd");
      }())
{
}

Watch::~Watch()
{
    close(notify_);
    close(signals_);
    if (reports_ >= 0) close(reports_);
}

int Watch::run()
{
    start();
    bool running = true;
    while (true) {
        std::array<pollfd, 3> ready = {{{notify_, POLLIN, 0}, {signals_, POLLIN, 0}, {reports_, POLLIN, 0}}};
        // Waits first for the stopped run to end, then for the changes to settle.
        const bool settling = !changed_.empty() && child_ == 0;
        const int events = poll(ready.data(), ready.size(), settling ? settle_time : -1);
        if (events < 0 && errno != EINTR) throw Error(fmt::format("--watch: {}", std::strerror(errno)));
        read_reports();
        read_events();
        read_signals();
        collect(running);
        if (ended_by_ != 0) {
            if (child_ == 0) return 128 + ended_by_;
            continue;
        }
        if (!changed_.empty() && child_ != 0) {
            stop();
        } else if (events == 0 && settling) {
            std::vector<std::string> names;
            for (const fs::path& file : changed_) names.push_back(fs::proximate(file).string());
            say(fmt::format("{} changed; running again", fmt::join(names, ", ")));
            start();
            running = true;
        }
    }
}

// Once at the end of the run, says how many files are watched: those that it read.
void Watch::collect(bool& running)
{
    if (child_ != 0 && waitpid(child_, nullptr, WNOHANG) == child_) child_ = 0;
    if (child_ != 0 || !running) return;
    running = false;
    read_reports();
    if (changed_.empty() && ended_by_ == 0)
        say(fmt::format("watching {} {}; Ctrl-C ends it", files_.size(), files_.size() == 1 ? "file" : "files"));
}

void Watch::start()
{
    changed_.clear();
    files_.clear();
    for (const auto& [number, folder] : folders_) inotify_rm_watch(notify_, number);
    folders_.clear();
    if (reports_ >= 0) close(reports_);
    partial_report_.clear();
    started_ = fs::file_time_type::clock::now();
    add(whole_path(graph_));

    int ends[2];
    checked(pipe2(ends, O_CLOEXEC), "pipe");
    reports_ = ends[0];
    fcntl(reports_, F_SETFL, O_NONBLOCK);
    std::vector<std::string> words = arguments_of_run();
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], report_descriptor);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    std::fflush(stdout);
    const int error = posix_spawn(&child_, "/proc/self/exe", &actions, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (error != 0) throw Error(fmt::format("--watch: the run can't be started: {}", std::strerror(error)));
}

// Complete frames stay; the run removes unfinished files.
void Watch::stop() { kill(child_, SIGTERM); }

void Watch::add(const fs::path& file)
{
    std::error_code none;
    for (const fs::path& path : {file, fs::weakly_canonical(file, none)}) {  // the target of a link may change, too
        if (path.empty() || !files_.insert(path).second) continue;
        const int number = inotify_add_watch(notify_, path.parent_path().c_str(),
                                             IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE);
        if (number >= 0) folders_[number] = path.parent_path();  // fails for a folder that does not exist
        // It may have changed before its folder was watched. (A wrong clock may have dated it in the future.)
        const auto written = fs::last_write_time(path, none);
        if (!none && written > started_ && written <= fs::file_time_type::clock::now()) changed_.insert(path);
    }
}

void Watch::read_reports()
{
    std::array<char, 4096> buffer;
    ssize_t size = 0;
    while (reports_ >= 0 && (size = read(reports_, buffer.data(), buffer.size())) > 0)
        partial_report_.append(buffer.data(), static_cast<std::size_t>(size));
    if (size == 0 && reports_ >= 0) {  // the run has closed it
        close(reports_);
        reports_ = -1;
    }
    for (std::size_t end = 0; (end = partial_report_.find('\n')) != std::string::npos;
         partial_report_.erase(0, end + 1))
        add(partial_report_.substr(0, end));
}

void Watch::read_events()
{
    alignas(inotify_event) std::array<char, 16384> buffer;
    ssize_t size = 0;
    while ((size = read(notify_, buffer.data(), buffer.size())) > 0)
        for (const char* at = buffer.data(); at < buffer.data() + size;) {
            const auto* event = reinterpret_cast<const inotify_event*>(at);
            at += sizeof(inotify_event) + event->len;
            const auto folder = folders_.find(event->wd);
            if (folder == folders_.end() || event->len == 0) continue;
            const fs::path file = folder->second / event->name;
            if (files_.count(file)) changed_.insert(file);
        }
}

void Watch::read_signals()
{
    signalfd_siginfo info;
    while (read(signals_, &info, sizeof info) == sizeof info) {
        if (info.ssi_signo == SIGCHLD) continue;
        ended_by_ = static_cast<int>(info.ssi_signo);
        if (child_ != 0)
            kill(child_, ended_by_);  // on Ctrl-C the terminal has signalled it already; twice does no harm
    }
}

void Watch::say(const std::string& text) const
{
    if (quiet_) return;
    print(text + '\n');
    std::fflush(stdout);
}

}  // namespace rapid

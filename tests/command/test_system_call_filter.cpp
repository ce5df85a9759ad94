// Operations that the sandbox forbids, each tried in a separate process.
#include "bindings/command_line/process_sandbox.h"

#include <fcntl.h>
#include <linux/keyctl.h>
#include <linux/perf_event.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/msg.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "tests/test.h"

using namespace rapid;

namespace {

constexpr int not_loaded = 254;

constexpr unsigned hangs_after = 60;  // s

// Returns the errno of a call that returns -1 in a process with the filter; 0 if it succeeds; minus the signal if one
// ended the process.
int error_in_sandbox(Processes processes, const std::function<long()>& call,
                     Connections connections = Connections::None)
{
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGALRM, SIG_DFL);
        alarm(hangs_after);
        if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || load_system_call_filter(processes, connections) != 0)
            _exit(not_loaded);
        errno = 0;
        _exit(call() == -1 ? errno : 0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

// A file owned by this process, which it could otherwise change in any way.
class OwnFile {
public:
    OwnFile() : path_(std::filesystem::temp_directory_path() / ("rapid_sandbox_" + std::to_string(getpid())))
    {
        descriptor_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    }
    ~OwnFile()
    {
        close(descriptor_);
        std::filesystem::remove(path_);
    }
    const char* path() const { return path_.c_str(); }
    int descriptor() const { return descriptor_; }

private:
    std::filesystem::path path_;
    int descriptor_;
};

}  // namespace

TEST_CASE("in the sandbox no other process is reached", "[untrusted]")
{
    const pid_t other = getpid();  // for the child that tries: its parent
    const std::map<std::string, std::function<long()>> calls = {
        {"kill", [=] { return kill(other, 0); }},
        {"kill of all", [] { return kill(-1, 0); }},
        {"tgkill", [=] { return syscall(SYS_tgkill, other, other, 0); }},
        {"tkill", [=] { return syscall(SYS_tkill, other, 0); }},
        {"rt_sigqueueinfo", [=] { return syscall(SYS_rt_sigqueueinfo, other, 0, nullptr); }},
        {"pidfd_open", [=] { return syscall(SYS_pidfd_open, other, 0); }},
        {"prlimit",
         [=] {
             const rlimit lower{8, 8};
             return syscall(SYS_prlimit64, other, RLIMIT_NOFILE, &lower, nullptr);
         }},
        {"setpriority", [=] { return setpriority(PRIO_PROCESS, static_cast<id_t>(other), 19); }},
        {"sched_setaffinity",
         [=] {
             cpu_set_t one;
             CPU_ZERO(&one);
             CPU_SET(0, &one);
             return sched_setaffinity(other, sizeof one, &one);
         }},
        {"process_vm_readv", [=] { return syscall(SYS_process_vm_readv, other, nullptr, 0, nullptr, 0, 0); }},
        {"ptrace", [=] { return syscall(SYS_ptrace, 16 /* attach */, other, 0, 0); }},
        {"signals of a descriptor", [=] { return fcntl(STDOUT_FILENO, F_SETOWN, other); }},
        {"typing on a terminal", [] { return ioctl(STDOUT_FILENO, TIOCSTI, "x"); }},
        {"setpgid", [=] { return setpgid(0, 0); }},
        {"locks of threads",
         [=] {
             void* head = nullptr;
             std::size_t size = 0;
             return syscall(SYS_get_robust_list, other, &head, &size);
         }},
    };
    for (const Processes processes : {Processes::None, Processes::Copies})
        for (const auto& [name, call] : calls) {
            CAPTURE(name);
            CHECK(error_in_sandbox(processes, call) == EPERM);
        }
}

TEST_CASE("a viewer's sandbox accepts connections, and makes none", "[untrusted]")
{
    const int listening = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0),
              client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof here;
    const auto* address = reinterpret_cast<const sockaddr*>(&here);
    REQUIRE(bind(listening, address, sizeof here) == 0);
    REQUIRE(listen(listening, 1) == 0);
    REQUIRE(getsockname(listening, reinterpret_cast<sockaddr*>(&here), &size) == 0);
    REQUIRE(connect(client, address, sizeof here) == 0);
    const auto converse = [&]() -> long {
        const int page = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC);
        return page < 0 ? -1 : send(page, "x", 1, MSG_NOSIGNAL);
    };
    CHECK(error_in_sandbox(Processes::None, converse, Connections::Accepted) == 0);
    char answer = 0;
    CHECK(recv(client, &answer, 1, 0) == 1);
    CHECK(error_in_sandbox(Processes::None, converse) == EPERM);
    const std::map<std::string, std::function<long()>> calls = {
        {"socket", [] { return socket(AF_INET, SOCK_STREAM, 0); }},
        {"local socket", [] { return socket(AF_UNIX, SOCK_DGRAM, 0); }},
        {"socketpair",
         [] {
             int ends[2];
             return socketpair(AF_UNIX, SOCK_STREAM, 0, ends);
         }},
        {"connect", [&] { return connect(client, address, sizeof here); }},
        {"bind", [&] { return bind(client, address, sizeof here); }},
        {"listen", [&] { return listen(client, 1); }},
    };
    for (const auto& [name, call] : calls) {
        CAPTURE(name);
        CHECK(error_in_sandbox(Processes::None, call, Connections::Accepted) == EPERM);
    }
    close(listening);
    close(client);
}

TEST_CASE("in the sandbox no file's mode, owner, time or attribute is changed", "[untrusted]")
{
    const OwnFile file;
    const std::map<std::string, std::function<long()>> calls = {
        {"chmod", [&] { return chmod(file.path(), 0777); }},
        {"fchmod", [&] { return fchmod(file.descriptor(), 0777); }},
        {"chown", [&] { return chown(file.path(), getuid(), getgid()); }},
        {"utimensat", [&] { return utimensat(AT_FDCWD, file.path(), nullptr, 0); }},
        {"futimens", [&] { return futimens(file.descriptor(), nullptr); }},
        {"setxattr", [&] { return setxattr(file.path(), "user.x", "x", 1, 0); }},
        {"removexattr", [&] { return removexattr(file.path(), "user.x"); }},
        {"mknod", [&] { return mknod((std::string(file.path()) + ".fifo").c_str(), S_IFIFO | 0600, 0); }},
        {"symlink", [&] { return symlink("/etc/passwd", (std::string(file.path()) + ".link").c_str()); }},
    };
    for (const auto& [name, call] : calls) {
        CAPTURE(name);
        CHECK(error_in_sandbox(Processes::None, call) == EPERM);
    }
}

TEST_CASE("in the sandbox there is no memory outside of the limits", "[untrusted]")
{
    const auto map_shared = [] {
        return reinterpret_cast<long>(
            mmap(nullptr, 1 << 20, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    };
    CHECK(error_in_sandbox(Processes::None, map_shared) == EPERM);
    // The mapping counts as a stack, whose limits apply when it grows by itself.
    const auto map_downwards = [] {
        return reinterpret_cast<long>(
            mmap(nullptr, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_GROWSDOWN, -1, 0));
    };
    for (const Processes processes : {Processes::None, Processes::Copies})
        CHECK(error_in_sandbox(processes, map_downwards) == EPERM);
    CHECK(error_in_sandbox(Processes::None, [] { return memfd_create("x", 0); }) == EPERM);
    CHECK(error_in_sandbox(Processes::None, [] { return shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0600); }) == EPERM);
    CHECK(error_in_sandbox(Processes::None, [] { return semget(IPC_PRIVATE, 1, IPC_CREAT | 0600); }) == EPERM);
    CHECK(error_in_sandbox(Processes::None, [] { return msgget(IPC_PRIVATE, IPC_CREAT | 0600); }) == EPERM);
}

// Each call would also fail without the filter, but with another error. If the filter fails, no page of the machine is
// lost.
TEST_CASE("in the sandbox no limit is set, no page is taken from the machine, and no thread is elsewhere",
          "[untrusted]")
{
    const rlimit inverse{2, 1};
    CHECK(error_in_sandbox(Processes::None, [&] { return setrlimit(RLIMIT_DATA, &inverse); }) == EPERM);
    rlimit requested{};
    CHECK(error_in_sandbox(Processes::None, [&] { return getrlimit(RLIMIT_DATA, &requested); }) == 0);
    const auto nowhere = reinterpret_cast<void*>(1);
    for (const Processes processes : {Processes::None, Processes::Copies})
        for (const int advice : {MADV_HWPOISON, 101 /* soft offline */, MADV_MERGEABLE, MADV_REMOVE})
            CHECK(error_in_sandbox(processes, [&] { return syscall(SYS_madvise, nowhere, 4096, advice); }) == EPERM);
    for (const int space : {CLONE_NEWNET, CLONE_NEWIPC, CLONE_NEWUTS, CLONE_NEWNS})
        CHECK(error_in_sandbox(Processes::None, [&] {
                  return syscall(SYS_clone, CLONE_THREAD | space, nullptr, nullptr, nullptr, nullptr);
              }) == EPERM);
}

TEST_CASE("in the sandbox there is no socket, no program, and no way around the filter", "[untrusted]")
{
    const std::map<std::string, std::function<long()>> calls = {
        {"socket", [] { return socket(AF_INET, SOCK_STREAM, 0); }},
        {"a local socket", [] { return socket(AF_UNIX, SOCK_STREAM, 0); }},
        {"execve", [] { return execl("/bin/true", "true", nullptr); }},
        {"unshare", [] { return unshare(CLONE_NEWUSER); }},
        {"io_uring", [] { return syscall(SYS_io_uring_setup, 1, nullptr); }},
        {"bpf", [] { return syscall(SYS_bpf, 0, nullptr, 0); }},
        {"perf_event_open", [] { return syscall(SYS_perf_event_open, nullptr, 0, -1, -1, 0); }},
        {"userfaultfd", [] { return syscall(SYS_userfaultfd, 0); }},
        {"keyctl", [] { return syscall(SYS_keyctl, KEYCTL_GET_KEYRING_ID, KEY_SPEC_SESSION_KEYRING, 0); }},
        {"a debugger's access", [] { return prctl(PR_SET_PTRACER, -1, 0, 0, 0); }},
    };
    for (const Processes processes : {Processes::None, Processes::Copies})
        for (const auto& [name, call] : calls) {
            CAPTURE(name);
            CHECK(error_in_sandbox(processes, call) == EPERM);
        }
    CHECK(error_in_sandbox(Processes::None, [] { return fork(); }) == EPERM);
}

TEST_CASE("in the sandbox a call of another architecture ends the process, and not its thread alone", "[untrusted]")
{
    constexpr long x32 = 0x40000000;  // __X32_SYSCALL_BIT
    const auto call = [] { return syscall(x32 | SYS_getpid); };
    for (const Processes processes : {Processes::None, Processes::Copies}) {
        CHECK(error_in_sandbox(processes, [&] {
                  std::thread([] {
                      for (;;) pause();
                  }).detach();
                  return call();
              }) == -SIGSYS);
        CHECK(error_in_sandbox(processes, [&] {
                  std::thread(call).join();
                  return 0L;
              }) == -SIGSYS);
    }
}

TEST_CASE("in the sandbox threads, files and memory are as ever", "[untrusted]")
{
    const OwnFile file;
    CHECK(error_in_sandbox(Processes::None, [&] {
              int seen = 0;
              std::thread([&] { seen = 1; }).join();
              char* const memory = new char[1 << 24];
              memory[0] = 1;
              delete[] memory;
              void* const mapped = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, file.descriptor(), 0);
              const bool all = seen == 1 && mapped != MAP_FAILED && write(file.descriptor(), "x", 1) == 1 &&
                               ftruncate(file.descriptor(), 0) == 0 && raise(SIGURG) == 0;
              return all ? 0L : -1L;
          }) == 0);
    CHECK(error_in_sandbox(Processes::Copies, [] {
              const pid_t copy = fork();
              if (copy == 0) _exit(7);
              int status = 0;
              return waitpid(copy, &status, 0) == copy && WEXITSTATUS(status) == 7 ? 0L : -1L;
          }) == 0);
}

TEST_CASE("in the sandbox a copy may give up what the others may do", "[untrusted]")
{
    CHECK(error_in_sandbox(Processes::Copies, [] {
              const pid_t copy = fork();
              if (copy == 0)
                  _exit(load_system_call_filter(Processes::None) == 0 && fork() == -1 && errno == EPERM ? 7 : 1);
              int status = 0;
              return waitpid(copy, &status, 0) == copy && WEXITSTATUS(status) == 7 ? 0L : -1L;
          }) == 0);
}

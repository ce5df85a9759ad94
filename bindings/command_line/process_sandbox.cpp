#include "bindings/command_line/process_sandbox.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bindings/scene/installation.h"
#include "runtime/base/error.h"
#include "runtime/files/read_sandboxed.h"

namespace rapid {
namespace {

Error refused(const std::string& what, int error)
{
    return Error(fmt::format("--untrusted: {} ({}); nothing was run", what, std::strerror(error)));
}

class File {
public:
    explicit File(int descriptor) : descriptor_(descriptor) {}
    ~File()
    {
        if (descriptor_ >= 0) close(descriptor_);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    operator int() const { return descriptor_; }

private:
    int descriptor_;
};

// Rights of versions of Landlock that are newer than Debian 12's headers (linux/landlock.h of 6.2, 6.10).
constexpr std::uint64_t truncate_right = 1ULL << 14, device_ioctl_right = 1ULL << 15;

constexpr std::uint64_t read_rights = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t write_rights = read_rights | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG |
                                       LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE;
constexpr std::uint64_t file_rights =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE | truncate_right;

// Returns all rights of the first version, and those of later ones that the kernel knows.
std::uint64_t handled_rights(int version)
{
    std::uint64_t rights = (1ULL << 13) - 1;
    if (version >= 2) rights |= LANDLOCK_ACCESS_FS_REFER;
    if (version >= 3) rights |= truncate_right;
    if (version >= 5) rights |= device_ioctl_right;
    return rights;
}

void allow(int ruleset, const std::filesystem::path& path, std::uint64_t rights)
{
    const File folder(open(path.c_str(), O_PATH | O_CLOEXEC));
    if (folder < 0) throw refused(fmt::format("can't open {}", path.string()), errno);
    if (!std::filesystem::is_directory(path)) rights &= file_rights;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = rights;
    rule.parent_fd = folder;
    if (syscall(SYS_landlock_add_rule, int(ruleset), LANDLOCK_RULE_PATH_BENEATH, &rule, 0) != 0)
        throw refused(fmt::format("Landlock refuses {}", path.string()), errno);
}

std::vector<std::filesystem::path> own_files()
{
    const Installation installation = Installation::find().value();
    std::vector<std::filesystem::path> files = {std::filesystem::read_symlink("/proc/self/exe"), installation.lua,
                                                installation.library};
    // Exposes only the process's memory usage. Its environment and address map stay unreadable.
    for (const char* path :
         {"/usr/lib", "/usr/local/lib", "/lib", "/lib64", "/etc/ld.so.cache", "/dev/null", "/proc/cpuinfo",
          "/proc/meminfo", "/proc/self/statm", "/proc/self/status", "/proc/self/cgroup"})
        if (std::filesystem::exists(path)) files.push_back(path);
    for (const auto& entry : std::filesystem::directory_iterator("/usr/share"))  // LuaJIT's own modules
        if (entry.path().filename().string().starts_with("lua")) files.push_back(entry.path());
    return files;
}

void restrict_files(const SandboxAccess& access)
{
    const auto version =
        static_cast<int>(syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION));
    if (version < 1)
        throw refused("this system has no Landlock (it needs Linux 5.13 or later, with Landlock enabled)", errno);
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = handled_rights(version);
    const File ruleset(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
    if (ruleset < 0) throw refused("Landlock refuses a set of rules", errno);
    for (const std::filesystem::path& path : own_files())
        allow(ruleset, path, read_rights | LANDLOCK_ACCESS_FS_EXECUTE);
    allow(ruleset, "/dev/null", LANDLOCK_ACCESS_FS_WRITE_FILE);
    for (const std::filesystem::path& path : access.readable)
        allow(ruleset, path, read_rights & attributes.handled_access_fs);
    for (const std::filesystem::path& path : access.writable)
        allow(ruleset, path, (write_rights | truncate_right) & attributes.handled_access_fs);
    if (syscall(SYS_landlock_restrict_self, int(ruleset), 0) != 0) throw refused("Landlock refuses", errno);
}

void restrict_system_calls(Processes processes, Connections connections = Connections::None)
{
    const int status = load_system_call_filter(processes, connections);
    if (status == -ENOSYS) throw refused("this system has no seccomp", ENOSYS);
    if (status != 0) throw refused("seccomp refuses the filter", -status);
}

// Closes inherited descriptors, which could reach files that Landlock would not open.
void close_inherited(int first)
{
    if (close_range(static_cast<unsigned>(first), ~0U, CLOSE_RANGE_CLOEXEC) != 0)
        throw refused("inherited descriptors can't be closed", errno);
    const File nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (nothing < 0 || dup2(nothing, STDIN_FILENO) < 0) throw refused("standard input can't be closed", errno);
}

// Root's privileges lift limits and reach the whole machine. The remaining ones open files of other users, as far as
// Landlock allows.
void give_up_privileges()
{
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct own[_LINUX_CAPABILITY_U32S_3];
    if (syscall(SYS_capget, &header, own) != 0) throw refused("privileges can't be read", errno);
    for (__user_cap_data_struct& word : own) word.inheritable = 0;
    if (syscall(SYS_capset, &header, own) != 0) throw refused("privileges can't be given up", errno);
    if (getuid() != 0 && geteuid() != 0) return;  // others have none after the process has restarted
    for (unsigned long one = 0; prctl(PR_CAPBSET_READ, one, 0, 0, 0) >= 0; ++one) {
        const bool is_kept = one == CAP_DAC_OVERRIDE || one == CAP_DAC_READ_SEARCH || one == CAP_FOWNER;
        if (is_kept || prctl(PR_CAPBSET_READ, one, 0, 0, 0) == 0) continue;
        if (prctl(PR_CAPBSET_DROP, one, 0, 0, 0) != 0) throw refused("privileges can't be given up", errno);
    }
}

// Returns the variables that the loader, the C library and Rapid need. The restarted process does not get the others,
// which may hold secrets.
std::vector<char*> own_environment()
{
    std::vector<char*> own;
    for (char** variable = environ; *variable; ++variable)
        for (const char* kept : {"RAPID_", "LD_", "LC_", "LANG=", "PATH=", "TERM=", "COLUMNS=", "TZ="})
            if (std::string_view(*variable).starts_with(kept)) own.push_back(*variable);
    own.push_back(nullptr);
    return own;
}

void limit(__rlimit_resource resource, rlim_t most)
{
    const rlimit value{most, most};
    if (setrlimit(resource, &value) != 0) throw refused("a limit can't be set", errno);
}

}  // namespace

void enter_sandbox(const SandboxAccess& access)
{
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) throw refused("new privileges can't be given up", errno);

    std::ifstream command("/proc/self/cmdline", std::ios::binary);
    std::vector<std::string> words;
    for (std::string word; std::getline(command, word, '\0');) words.push_back(word);
    words.insert(words.begin() + 1, sandboxed_option);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string program = std::filesystem::read_symlink("/proc/self/exe");

    close_inherited(access.first_closed);
    give_up_privileges();
    restrict_files(access);
    execve(program.c_str(), arguments.data(), own_environment().data());
    throw refused("can't restart in the sandbox", errno);
}

void complete_sandbox(Processes processes, Connections connections)
{
    const File root(open("/", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (root >= 0) throw Error("--untrusted: the process is not inside Landlock; nothing was run");
    limit(RLIMIT_CORE, 0);
#ifndef RAPID_ADDRESS_SANITIZER  // its mappings exceed the limit
    limit(RLIMIT_DATA, static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)));
#endif
    // Processes that a hostile file might take over have no rights but to read. The process from which such copies are
    // forked cannot fork others.
    confine_copies([] { restrict_system_calls(Processes::None); });
    if (processes == Processes::None) start_reader_process([] { restrict_system_calls(Processes::Copies); });
    restrict_system_calls(processes, connections);
}

namespace {

// Files (Landlock decides which), memory, threads, time; and calls on this process that cannot reach another one.
constexpr int allowed[] = {
    // open files
    SCMP_SYS(read), SCMP_SYS(readv), SCMP_SYS(pread64), SCMP_SYS(preadv), SCMP_SYS(preadv2), SCMP_SYS(write),
    SCMP_SYS(writev), SCMP_SYS(pwrite64), SCMP_SYS(pwritev), SCMP_SYS(pwritev2), SCMP_SYS(lseek), SCMP_SYS(close),
    SCMP_SYS(close_range), SCMP_SYS(dup), SCMP_SYS(dup2), SCMP_SYS(dup3), SCMP_SYS(fstat), SCMP_SYS(fstatfs),
    SCMP_SYS(ftruncate), SCMP_SYS(fallocate), SCMP_SYS(fsync), SCMP_SYS(fdatasync), SCMP_SYS(sync_file_range),
    SCMP_SYS(flock), SCMP_SYS(fadvise64), SCMP_SYS(readahead), SCMP_SYS(copy_file_range), SCMP_SYS(sendfile),
    SCMP_SYS(poll), SCMP_SYS(ppoll), SCMP_SYS(select), SCMP_SYS(pselect6), SCMP_SYS(pipe), SCMP_SYS(pipe2),
    // files by name
    SCMP_SYS(open), SCMP_SYS(openat), SCMP_SYS(stat), SCMP_SYS(lstat), SCMP_SYS(newfstatat), SCMP_SYS(statx),
    SCMP_SYS(statfs), SCMP_SYS(access), SCMP_SYS(faccessat), SCMP_SYS(faccessat2), SCMP_SYS(readlink),
    SCMP_SYS(readlinkat), SCMP_SYS(getdents64), SCMP_SYS(getcwd), SCMP_SYS(mkdir), SCMP_SYS(mkdirat), SCMP_SYS(rmdir),
    SCMP_SYS(unlink), SCMP_SYS(unlinkat), SCMP_SYS(link), SCMP_SYS(linkat), SCMP_SYS(rename), SCMP_SYS(renameat),
    SCMP_SYS(renameat2), SCMP_SYS(umask),
    // memory
    SCMP_SYS(brk), SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(mprotect), SCMP_SYS(mincore), SCMP_SYS(membarrier),
    // threads and signals of the process
    SCMP_SYS(futex), SCMP_SYS(set_robust_list), SCMP_SYS(rseq), SCMP_SYS(set_tid_address), SCMP_SYS(arch_prctl),
    SCMP_SYS(gettid), SCMP_SYS(getpid), SCMP_SYS(getppid), SCMP_SYS(getpgrp), SCMP_SYS(exit), SCMP_SYS(exit_group),
    SCMP_SYS(sched_yield), SCMP_SYS(sched_getaffinity), SCMP_SYS(sched_getparam), SCMP_SYS(sched_getscheduler),
    SCMP_SYS(sched_get_priority_min), SCMP_SYS(sched_get_priority_max), SCMP_SYS(getcpu), SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(rt_sigtimedwait), SCMP_SYS(rt_sigpending),
    SCMP_SYS(rt_sigsuspend), SCMP_SYS(sigaltstack), SCMP_SYS(restart_syscall), SCMP_SYS(pause),
    // time, and information about the system
    SCMP_SYS(clock_gettime), SCMP_SYS(clock_getres), SCMP_SYS(clock_nanosleep), SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday), SCMP_SYS(time), SCMP_SYS(times), SCMP_SYS(getrusage), SCMP_SYS(uname), SCMP_SYS(sysinfo),
    SCMP_SYS(getrandom), SCMP_SYS(getrlimit), SCMP_SYS(getuid), SCMP_SYS(geteuid), SCMP_SYS(getgid), SCMP_SYS(getegid)};

class Filter {
public:
    Filter() : context_(seccomp_init(SCMP_ACT_ERRNO(EPERM)), seccomp_release)
    {
        status_ = context_ ? 0 : -ENOSYS;
        set(SCMP_FLTATR_CTL_TSYNC, 1);  // all threads
        // The default action would end only the calling thread; the others, and the process's parent, would wait for
        // it.
        set(SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
    }

    void allow(int call) { add(SCMP_ACT_ALLOW, call, {}); }
    void allow_if(int call, std::initializer_list<scmp_arg_cmp> arguments) { add(SCMP_ACT_ALLOW, call, arguments); }
    // Allows a call if its second argument is one of these values.
    void allow_commands(int call, std::initializer_list<unsigned> commands)
    {
        for (const unsigned command : commands) allow_if(call, {SCMP_A1_32(SCMP_CMP_EQ, command)});
    }
    // Does the same for the third argument.
    void allow_advice(int call, std::initializer_list<unsigned> advices)
    {
        for (const unsigned advice : advices) allow_if(call, {SCMP_A2_32(SCMP_CMP_EQ, advice)});
    }
    void fail(int call, int error) { add(SCMP_ACT_ERRNO(static_cast<std::uint32_t>(error)), call, {}); }
    int load() { return status_ == 0 ? seccomp_load(context_.get()) : status_; }

private:
    void set(scmp_filter_attr attribute, std::uint32_t value)
    {
        if (status_ == 0) status_ = seccomp_attr_set(context_.get(), attribute, value);
    }
    void add(std::uint32_t action, int call, std::initializer_list<scmp_arg_cmp> arguments)
    {
        if (status_ != 0) return;
        status_ = seccomp_rule_add_array(context_.get(), action, call, static_cast<unsigned>(arguments.size()),
                                         arguments.begin());
    }

    std::unique_ptr<void, void (*)(scmp_filter_ctx)> context_;
    int status_ = 0;
};

// Adds calls that depend on their arguments.
void add_by_arguments(Filter& filter, Processes processes)
{
    const auto own = static_cast<scmp_datum_t>(getpid());

    // Two kinds of mappings escape the memory limits: anonymous shared memory, through which copies return results, and
    // mappings that grow downwards, as stacks do.
    const scmp_datum_t shared = MAP_SHARED | MAP_ANONYMOUS, kind = shared | MAP_GROWSDOWN;
    for (const scmp_datum_t allowed_kind : {scmp_datum_t{0}, scmp_datum_t{MAP_SHARED}, scmp_datum_t{MAP_ANONYMOUS}})
        filter.allow_if(SCMP_SYS(mmap), {SCMP_A3(SCMP_CMP_MASKED_EQ, kind, allowed_kind)});

    // Advice on memory must affect only this process: pages are neither taken from the machine nor merged with those of
    // others.
    filter.allow_advice(SCMP_SYS(madvise), {MADV_NORMAL, MADV_RANDOM, MADV_SEQUENTIAL, MADV_WILLNEED, MADV_DONTNEED,
                                            MADV_FREE, MADV_HUGEPAGE, MADV_NOHUGEPAGE, MADV_DONTDUMP});

    // Excludes owners of a descriptor's signals, leases and notifications.
    filter.allow_commands(SCMP_SYS(fcntl), {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_GETLK,
                                            F_SETLK, F_SETLKW, F_OFD_GETLK, F_OFD_SETLK, F_OFD_SETLKW});
    filter.allow_commands(SCMP_SYS(ioctl), {TCGETS, TIOCGWINSZ});  // checks for a terminal and its width

    for (const int call : {SCMP_SYS(kill), SCMP_SYS(tgkill)}) filter.allow_if(call, {SCMP_A0(SCMP_CMP_EQ, own)});
    filter.allow_if(SCMP_SYS(sched_setaffinity), {SCMP_A0(SCMP_CMP_EQ, 0)});
    for (const int option : {PR_SET_NAME, PR_GET_NAME})
        filter.allow_if(SCMP_SYS(prctl), {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(option))});

    // A filter cannot see the flags of clone3; the C library then uses clone.
    filter.fail(SCMP_SYS(clone3), ENOSYS);
    constexpr scmp_datum_t spaces =
        CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER | CLONE_NEWPID | CLONE_NEWNET;
    if (processes == Processes::Copies) {
        filter.allow_if(SCMP_SYS(prlimit64), {SCMP_A0(SCMP_CMP_EQ, 0)});  // in a copy, which lowers its own
        filter.allow_if(SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, spaces, 0)});
        filter.allow(SCMP_SYS(wait4));
        filter.allow(SCMP_SYS(memfd_create));  // holds the frames of a reference, for all copies
        filter.allow_if(SCMP_SYS(mmap), {SCMP_A3(SCMP_CMP_MASKED_EQ, kind, shared)});
        filter.allow(SCMP_SYS(setitimer));  // in a copy that reads a file
        for (const int option : {PR_SET_PDEATHSIG, PR_SET_NO_NEW_PRIVS})
            filter.allow_if(SCMP_SYS(prctl), {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(option))});
        filter.allow(SCMP_SYS(seccomp));  // a further filter can only forbid more
    } else {
        filter.allow_if(SCMP_SYS(prlimit64), {SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A2(SCMP_CMP_EQ, 0)});  // read only
        filter.allow_if(SCMP_SYS(clone), {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD | spaces, CLONE_THREAD)});
    }
}

// Calls on accepted connections. A server cannot create sockets.
constexpr int allowed_of_accepted[] = {
    SCMP_SYS(accept),      SCMP_SYS(accept4),       SCMP_SYS(recvfrom),       SCMP_SYS(recvmsg),
    SCMP_SYS(sendto),      SCMP_SYS(sendmsg),       SCMP_SYS(shutdown),       SCMP_SYS(getsockname),
    SCMP_SYS(getpeername), SCMP_SYS(getsockopt),    SCMP_SYS(setsockopt),     SCMP_SYS(epoll_wait),
    SCMP_SYS(epoll_pwait), SCMP_SYS(epoll_create1), SCMP_SYS(epoll_ctl),      SCMP_SYS(timerfd_create),
    SCMP_SYS(eventfd2),    SCMP_SYS(eventfd),       SCMP_SYS(timerfd_settime)};

}  // namespace

int load_system_call_filter(Processes processes, Connections connections)
{
    Filter filter;
    for (const int call : allowed) filter.allow(call);
    if (connections == Connections::Accepted) {
        for (const int call : allowed_of_accepted) filter.allow(call);
        filter.allow_commands(SCMP_SYS(ioctl), {FIONBIO});
    }
    add_by_arguments(filter, processes);
    return filter.load();
}

}  // namespace rapid

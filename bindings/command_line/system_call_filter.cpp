#include "bindings/command_line/system_call_filter.h"

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <initializer_list>
#include <memory>

namespace rapid {
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

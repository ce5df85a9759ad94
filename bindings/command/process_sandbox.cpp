#include "bindings/command/process_sandbox.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

#include "bindings/host/modules.h"
#include "runtime/error.h"
#include "runtime/points/point_set.h"

namespace rapid {
namespace {

Error refused(const std::string& what, int error)
{
    return Error(fmt::format("--untrusted: {} ({}); the graph was not run", what, std::strerror(error)));
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

// All rights of the first version, and those of later ones that the kernel knows.
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
    std::vector<std::filesystem::path> files = {std::filesystem::read_symlink("/proc/self/exe"), lua_folder(),
                                                "/proc/self"};
    Dl_info library;
    if (dladdr(reinterpret_cast<void*>(&known_attribute), &library) != 0)
        files.push_back(std::filesystem::path(library.dli_fname).parent_path());
    for (const char* path : {"/usr/lib", "/usr/local/lib", "/lib", "/lib64", "/etc/ld.so.cache", "/dev/null"})
        if (std::filesystem::exists(path)) files.push_back(path);
    for (const auto& entry : std::filesystem::directory_iterator("/usr/share"))  // LuaJIT's own modules
        if (entry.path().filename().string().starts_with("lua")) files.push_back(entry.path());
    return files;
}

void restrict_files(const SandboxAccess& access)
{
    const auto version =
        static_cast<int>(syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION));
    if (version < 1) throw refused("this system has no Landlock (Linux 5.13 has, where it is switched on)", errno);
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = handled_rights(version);
    const File ruleset(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
    if (ruleset < 0) throw refused("Landlock refuses a set of rules", errno);
    for (const std::filesystem::path& path : own_files())
        allow(ruleset, path, read_rights | LANDLOCK_ACCESS_FS_EXECUTE);
    for (const std::filesystem::path& path : access.readable)
        allow(ruleset, path, read_rights & attributes.handled_access_fs);
    for (const std::filesystem::path& path : access.writable)
        allow(ruleset, path, (write_rights | truncate_right) & attributes.handled_access_fs);
    if (syscall(SYS_landlock_restrict_self, int(ruleset), 0) != 0) throw refused("Landlock refuses", errno);
}

void restrict_system_calls()
{
    const std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter(seccomp_init(SCMP_ACT_ALLOW), seccomp_release);
    if (!filter) throw refused("this system has no seccomp", ENOSYS);
    const auto check = [](int status) {
        if (status != 0) throw refused("seccomp refuses a rule", -status);
    };
    check(seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_TSYNC, 1));  // all threads
    // io_uring would bypass the filter.
    for (const int call : {SCMP_SYS(socket),
                           SCMP_SYS(socketpair),
                           SCMP_SYS(connect),
                           SCMP_SYS(bind),
                           SCMP_SYS(listen),
                           SCMP_SYS(accept),
                           SCMP_SYS(accept4),
                           SCMP_SYS(execve),
                           SCMP_SYS(execveat),
                           SCMP_SYS(fork),
                           SCMP_SYS(vfork),
                           SCMP_SYS(ptrace),
                           SCMP_SYS(process_vm_readv),
                           SCMP_SYS(process_vm_writev),
                           SCMP_SYS(pidfd_open),
                           SCMP_SYS(pidfd_getfd),
                           SCMP_SYS(io_uring_setup),
                           SCMP_SYS(io_uring_enter),
                           SCMP_SYS(io_uring_register),
                           SCMP_SYS(bpf),
                           SCMP_SYS(perf_event_open),
                           SCMP_SYS(userfaultfd),
                           SCMP_SYS(keyctl),
                           SCMP_SYS(add_key),
                           SCMP_SYS(request_key),
                           SCMP_SYS(mount),
                           SCMP_SYS(umount2),
                           SCMP_SYS(pivot_root),
                           SCMP_SYS(chroot),
                           SCMP_SYS(setns),
                           SCMP_SYS(unshare),
                           SCMP_SYS(open_by_handle_at),
                           SCMP_SYS(init_module),
                           SCMP_SYS(finit_module),
                           SCMP_SYS(kexec_load),
                           SCMP_SYS(memfd_create)})
        check(seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(EPERM), call, 0));
    // Threads are made by clone; a filter can't see clone3's flags, and the C library then falls back.
    check(seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(EPERM), SCMP_SYS(clone), 1,
                           SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)));
    check(seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0));
    check(seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(EPERM), SCMP_SYS(kill), 1,
                           SCMP_A0(SCMP_CMP_NE, static_cast<scmp_datum_t>(getpid()))));
    check(seccomp_load(filter.get()));
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
    words.push_back(sandboxed_option);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string program = std::filesystem::read_symlink("/proc/self/exe");

    restrict_files(access);
    execv(program.c_str(), arguments.data());
    throw refused("can't begin anew behind the walls", errno);
}

void complete_sandbox()
{
    const File root(open("/", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (root >= 0) throw Error("--untrusted: the process is not inside of Landlock; the graph was not run");
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_DATA, static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)));
    restrict_system_calls();
}

}  // namespace rapid

#include "bindings/command_line/process_sandbox.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
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

}  // namespace rapid

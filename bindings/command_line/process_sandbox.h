// A sandbox around a process that runs an untrusted graph or reads an untrusted file.
//
// The interpreter's own environment (lua/sandbox.lua) is the first barrier, but no interpreter is safe enough alone.
// Code that escapes it meets limits of the operating system, which the process cannot lift again:
//
//   Landlock    it reads only `readable` (recursively), Rapid's own files, RAPID_PATH and the system's libraries, and
//               creates and changes files only below `writable`
//   seccomp     it makes the system calls that Rapid needs: it opens no socket, starts no
//               process, reaches no other process, and changes no mode, owner, time or attribute of a file
//   environment only the variables of the loader, the C library and Rapid
//   privileges  of root's only those that open files of other users, and no new ones
//   limits      no core file; no more private memory than the machine has, and no shared memory
//   descriptors inherited ones are closed, except standard output, standard error and a viewer's socket
//   files       formats whose libraries trust their input are read by a process started before (read_sandboxed.h),
//               in the same sandbox: each file in a copy of it, which may start nothing
//
// It is not promised that the process ends (see --script-timeout), that it leaves the processor to others, or that it
// does not fill the disk of a folder that it may write to.
#pragma once

#include <filesystem>
#include <vector>

namespace rapid {

// The allowlist of system calls for a sandboxed process (seccomp). All others fail with EPERM. A call by the numbers of
// another architecture (32 bits, x32) ends the process with SIGSYS.
enum class Processes {
    None,    // threads only
    Copies,  // may fork, and wait for the copies, which have the same filter; starts no other program
};

enum class Connections {
    None,
    Accepted,  // accepts on a socket that already listens; cannot create sockets
};

// Installs the filter on all threads and their children. Returns a seccomp status: 0, or a negative errno.
int load_system_call_filter(Processes processes, Connections connections = Connections::None);

struct SandboxAccess {
    std::vector<std::filesystem::path> readable, writable;  // files, or folders including everything below
    int first_closed = 3;                                   // first inherited descriptor that is closed
};

// Restarts the process inside Landlock, with `sandboxed_option` before its arguments: Landlock confines only the
// calling thread, and linked libraries start threads before main. Returns only by throwing Error, if the kernel has no
// Landlock or a path does not exist.
inline constexpr const char* sandboxed_option = "--sandboxed";
[[noreturn]] void enter_sandbox(const SandboxAccess& access);

// Sets the other limits in the restarted process, for all threads. Throws Error if the process is not inside Landlock,
// or the kernel has no seccomp; then nothing may be run.
void complete_sandbox(Processes processes, Connections connections = Connections::None);

}  // namespace rapid

// A sandbox around a process that runs an untrusted graph or reads an untrusted file.
//
// The interpreter's own environment (lua/sandbox.lua) comes first, but no interpreter is safe enough alone. What gets
// through it meets the limits of the system, which the process can't lift again:
//
//   Landlock    it reads `readable` and what is below, Rapid's own files, RAPID_PATH and the system's libraries,
//               creates and changes files below `writable`, and nothing else
//   seccomp     it makes the system calls that Rapid needs (system_call_filter.h): it opens no socket, starts no
//               process, reaches no other process, and changes no mode, owner, time or attribute of a file
//   environment it has that of the loader, the C library and Rapid
//   privileges  of root's those that open files of other users, and no new ones
//   limits      no core file; no more memory of its own than the machine has, and none that is shared
//   descriptors those that it inherited are closed, but for standard output and standard error, and a viewer's socket
//   files       of formats whose libraries trust them are read by a process that is started before (reader_process.h),
//               in the same sandbox: each in a copy of it, which may start nothing
//
// Not promised: that it ends (see --script-timeout), that it leaves the processor to others, or that it does not fill
// the disk of a folder that it may write to.
#pragma once

#include <filesystem>
#include <vector>

#include "bindings/command_line/system_call_filter.h"

namespace rapid {

struct SandboxAccess {
    std::vector<std::filesystem::path> readable, writable;  // files, or folders with all that is below
    int first_closed = 3;                                   // of the inherited descriptors
};

// Landlock holds the calling thread alone, and linked libraries start threads before main: so the process restarts
// inside of it, with `sandboxed_option` before its arguments. Returns only to throw. Error: the kernel has no
// Landlock, or a path does not exist.
inline constexpr const char* sandboxed_option = "--sandboxed";
[[noreturn]] void enter_sandbox(const SandboxAccess& access);

// In the restarted process: the other limits, for all threads. Error: the process is not inside of Landlock, or the
// kernel has no seccomp; then nothing may be run.
void complete_sandbox(Processes processes, Connections connections = Connections::None);

}  // namespace rapid

// A sandbox around a process that runs an untrusted graph.
//
// The interpreter's own environment (lua/sandbox.lua) comes first, but no interpreter is safe enough alone. What gets
// through it meets the limits of the system, which the process can't lift again:
//
//   Landlock    it reads `readable` and what is below, Rapid's own files and the system's libraries, creates and
//               changes files below `writable`, and nothing else
//   seccomp     it opens no socket, starts no process, and inspects no other process
//   limits      no core file; no more memory of its own than the machine has
//
// Not promised: that it ends (see --script-timeout), that it leaves the processor to others, or that it does not fill
// the disk of a folder that it may write to.
#pragma once

#include <filesystem>
#include <vector>

namespace rapid {

struct SandboxAccess {
    std::vector<std::filesystem::path> readable, writable;  // files, or folders with all that is below
};

// Landlock holds the calling thread alone, and linked libraries start threads before main: so the process restarts
// inside of it, with its arguments and `sandboxed_option` behind them. Returns only to throw. Error: the kernel has no
// Landlock, or a path does not exist.
inline constexpr const char* sandboxed_option = "--within-walls";
[[noreturn]] void enter_sandbox(const SandboxAccess& access);

// In the restarted process: the other limits, for all threads. Error: the process is not inside of Landlock, or the
// kernel has no seccomp; then nothing may be run.
void complete_sandbox();

}  // namespace rapid

// The system's walls around a process that runs a graph which nobody vouches for.
//
// The interpreter's own environment (lua/sandbox.lua) is the first wall; no interpreter is the last. What gets through
// it meets these, which the process can't take down again:
//
//   Landlock    it reads `readable` and what is below, Rapid's own files and the system's libraries, creates and
//               changes files below `writable`, and nothing else
//   seccomp     it opens no socket, starts no process, and looks into no other one
//   limits      no core file; no more memory of its own than the machine has
//
// Not promised: that it ends (see --script-timeout), that it leaves the processor to others, or that it does not fill
// the disk of a folder that it may write to.
#pragma once

#include <filesystem>
#include <vector>

namespace rapid {

struct Openings {
    std::vector<std::filesystem::path> readable, writable;  // files, or folders with all that is below
};

// A library that is linked starts threads before main, and Landlock holds the calling thread alone: so the process
// begins anew inside of it, with its arguments and `within_walls` behind them. Returns only to throw. Error: the kernel
// has no Landlock, or an opening does not exist.
inline constexpr const char* within_walls = "--within-walls";
[[noreturn]] void enter_walls(const Openings& openings);

// Within: the rest of the walls, around all threads. Error: the process is not inside of Landlock, or the kernel has no
// seccomp; then nothing may be run.
void close_walls();

}  // namespace rapid

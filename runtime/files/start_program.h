// Starts other programs: ffmpeg, dot.
#pragma once

#include <sys/types.h>

#include <string>
#include <utility>
#include <vector>

namespace rapid {

// Finds other programs: ffmpeg, dot, those of Slurm.

// Returns the first program of this name on PATH, or an empty path. Only absolute folders are searched: a program in
// the current folder may have come with a downloaded scene.
std::string program_path(const std::string& name);

// Starts a program. words: its arguments, including its own name. descriptors: pairs of our descriptor and its number
// in the program. Other descriptors are inherited according to their flags (O_CLOEXEC). Signal handlers and mask are
// reset, as those of this thread may be blocked. Throws Error with the path and the system's reason.
pid_t start_program(const std::string& path, std::vector<std::string> words,
                    const std::vector<std::pair<int, int>>& descriptors);

// Waits for the program and returns its status, as waitpid() reports it.
int wait_for_program(pid_t program);

}  // namespace rapid

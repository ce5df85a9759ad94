// Other programs that are started: ffmpeg, dot.
#pragma once

#include <sys/types.h>

#include <string>
#include <utility>
#include <vector>

namespace rapid {

// Starts a program. words: with its name, as it is to know it. descriptors: ours, and which one each is to it; others
// it has as their flags say (O_CLOEXEC). Signals are as a program expects them: those of this thread may be blocked,
// for a thread that waits for them. Error: the system's, with the path.
pid_t start_program(const std::string& path, std::vector<std::string> words,
                    const std::vector<std::pair<int, int>>& descriptors);

// Its status, as waitpid() gives it, when it has ended.
int wait_for_program(pid_t program);

}  // namespace rapid

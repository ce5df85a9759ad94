// Runs many commands, some at a time, each in a process of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace rapid {

struct EndedProcess {
    std::string failure;  // empty: status 0; else what it said last on standard error, or the signal that ended it
    int status = 0;       // of the exit; 128 + the number of a signal
};

// Runs `rapid` `count` times, at most `jobs` at a time, in order; `words` gives the arguments of each. `ended`
// hears how each ended, in this thread. What they print goes nowhere. A signal that ends this process (Ctrl-C, SIGTERM,
// ...) is passed on to those that run; then it returns 128 + its number, when all have ended; else 0.
//
// Must be called before this process starts a thread, which would take the signals.
int run_processes(std::size_t count, int jobs, const std::function<std::vector<std::string>(std::size_t)>& words,
                  const std::function<void(std::size_t, const EndedProcess&)>& ended);

}  // namespace rapid

// Child processes of the commands: rows of a wedge, scenes of a study, the programs of a scheduler.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "runtime/base/json.h"

namespace rapid {

struct EndedProcess {
    std::string failure;  // empty for status 0; else its last message on standard error, or the signal that ended it
    int status = 0;       // exit status; 128 + the number of a signal
};

// Runs `rapid` `count` times, at most `jobs` at a time, in order; `words` returns the arguments of each. `ended` is
// called on this thread with the result of each. Their standard output is discarded. A signal that ends this process
// (Ctrl-C, SIGTERM, ...) is passed on to the running ones; it then returns 128 + its number when all have ended; else
// 0.
//
// Must be called before this process starts a thread, which would take the signals.
int run_processes(std::size_t count, int jobs, const std::function<std::vector<std::string>(std::size_t)>& words,
                  const std::function<void(std::size_t, const EndedProcess&)>& ended);

using ReportToParent = std::function<void(const CheckedJson& event)>;

// Forks. The child does `work`, reports events and ends; this process hears each as it arrives. Returns an empty text,
// or how the child ended abnormally: "signal 11 (Segmentation fault)", "status 1".
//
// This process must have no other threads (a child would inherit locks that are never freed), so sessions and the
// runtime, which start threads, belong in children. A child's standard output goes to standard error, so that output of
// scripts does not mix with the parent's results.
std::string run_in_child(const std::function<void(const ReportToParent& report)>& work,
                         const std::function<void(const CheckedJson& event)>& on_event);

// Makes this process end when its parent does, however the parent ends.
void end_with_parent(int parent);

struct ProgramOutput {
    int status;  // 127: it cannot be started
    std::string out, errors;
};

// Runs a program found on PATH.
ProgramOutput output_of(const std::vector<std::string>& words);

}  // namespace rapid

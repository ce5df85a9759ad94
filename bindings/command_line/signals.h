// Ends a run on Ctrl-C, Ctrl-\, SIGTERM or SIGHUP from an ordinary thread, which may take locks and write files, unlike
// a signal handler.
#pragma once

#include <atomic>
#include <csignal>
#include <functional>
#include <thread>

namespace rapid {

// Returns SIGINT, SIGTERM, SIGHUP and SIGQUIT, without those that were ignored when the program started (nohup).
sigset_t ending_signals();

class SignalThread {
public:
    // `end` gets the signal and must not return. Construct this before any other thread, since threads inherit the mask
    // that blocks these signals. Ignored signals stay ignored.
    explicit SignalThread(std::function<void(int signal)> end);
    ~SignalThread();
    SignalThread(const SignalThread&) = delete;
    SignalThread& operator=(const SignalThread&) = delete;

private:
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace rapid

// Ends a run that the user (Ctrl-C) or the system (SIGTERM) wants ended, from an ordinary thread: locks may be taken
// and files written there, which a signal handler can't do.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace rapid {

class SignalThread {
public:
    // `end` gets the signal and must not return. Made before any other thread, which then inherits that these signals
    // are not its own. A signal that was ignored when the program started (nohup) stays so.
    explicit SignalThread(std::function<void(int signal)> end);
    ~SignalThread();
    SignalThread(const SignalThread&) = delete;
    SignalThread& operator=(const SignalThread&) = delete;

private:
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace rapid

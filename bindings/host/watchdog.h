// The watchdog of --script-timeout: a thread that detects when a script overruns, even in compiled code.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace rapid {

class Watchdog {
public:
    enum Reaction { EndProcess, Continue };
    using OnTimeout = std::function<Reaction(const std::string& message)>;

    // limit: seconds that a section may take. on_timeout: called from the watchdog's thread, repeatedly while a late
    // section lasts. If it returns EndProcess, the process ends with the message on standard error.
    Watchdog(double limit, OnTimeout on_timeout);
    ~Watchdog();

    // A stretch of script whose time counts. Concurrent sections each get as much time as if they ran alone.
    class Section {
    public:
        Section(Watchdog& watchdog, std::string what);
        ~Section();

    private:
        Watchdog& watchdog_;
    };

private:
    void watch();

    const double limit_;
    const OnTimeout on_timeout_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<std::string> running_;
    std::chrono::steady_clock::time_point deadline_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace rapid

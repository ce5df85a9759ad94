// The watchdog of --script-timeout: it ends the run from a thread of its own when a script overruns, since compiled
// traces can't be interrupted.
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
    // limit: s, that a section may take. on_timeout: called from the watchdog's thread; it must not return to the
    // script. If it returns, or where there is none, the process ends.
    Watchdog(double limit, std::function<void(const std::string& message)> on_timeout);
    ~Watchdog();

    // A stretch of script whose time counts. Sections that run together have as much time as if each ran alone.
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
    const std::function<void(const std::string& message)> on_timeout_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<std::string> running_;
    std::chrono::steady_clock::time_point deadline_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace rapid

// The watchdog of --script-timeout: a thread of its own that sees when a script overruns, which may be in compiled
// code.
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
    enum Then { EndProcess, GoOn };
    using Late = std::function<Then(const std::string& message)>;

    // limit: s, that a section may take. on_late: called from the watchdog's thread, again and again while the section
    // lasts. Where it says so the process ends, with the message on standard error.
    Watchdog(double limit, Late on_late);
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
    const Late on_late_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<std::string> running_;
    std::chrono::steady_clock::time_point deadline_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace rapid

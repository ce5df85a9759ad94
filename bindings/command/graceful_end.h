// Handles a signal that ends a run: with snapshots, the current frame may complete within a grace period.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace rapid {

class GracefulEnd {
public:
    // end_now: called with the signal from another thread when the grace period is over; it must not return.
    GracefulEnd(double grace, std::function<void(int signal)> end_now);
    ~GracefulEnd();
    GracefulEnd(const GracefulEnd&) = delete;
    GracefulEnd& operator=(const GracefulEnd&) = delete;

    // Allows a graceful end from now on: there is something to save.
    void allow();
    // Called from the signals' thread. Returns false for the second signal, and if there is nothing to save: the run
    // must end now.
    bool request(int signal);
    // Returns the received signal; 0: none.
    int signal() const;

private:
    void wait();

    const double grace_;
    const std::function<void(int signal)> end_now_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool is_allowed_ = false, is_over_ = false;
    int signal_ = 0;
    std::thread thread_;
};

}  // namespace rapid

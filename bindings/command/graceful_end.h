// A signal that ends a run: with snapshots, the frame that is being computed may end within a time of grace.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace rapid {

class GracefulEnd {
public:
    // too_late: called with the signal from a thread of its own when the grace is over; it must not return.
    GracefulEnd(double grace, std::function<void(int signal)> too_late);
    ~GracefulEnd();
    GracefulEnd(const GracefulEnd&) = delete;
    GracefulEnd& operator=(const GracefulEnd&) = delete;

    // From now on there is something that can be kept.
    void allow();
    // From the signals' thread. False for the second signal, and where there is nothing to keep: the run is to end now.
    bool ask(int signal);
    // The signal that was asked for; 0: none.
    int signal() const;

private:
    void wait();

    const double grace_;
    const std::function<void(int signal)> too_late_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool is_allowed_ = false, is_over_ = false;
    int signal_ = 0;
    std::thread thread_;
};

}  // namespace rapid

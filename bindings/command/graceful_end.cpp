#include "bindings/command/graceful_end.h"

#include <chrono>
#include <utility>

namespace rapid {

GracefulEnd::GracefulEnd(double grace, std::function<void(int signal)> end_now)
    : grace_(grace), end_now_(std::move(end_now))
{
}

GracefulEnd::~GracefulEnd()
{
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
        is_allowed_ = false;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void GracefulEnd::allow()
{
    const std::lock_guard lock(mutex_);
    is_allowed_ = true;
}

bool GracefulEnd::request(int signal)
{
    const std::lock_guard lock(mutex_);
    if (!is_allowed_ || signal_ != 0) return false;
    signal_ = signal;
    thread_ = std::thread([this] { wait(); });
    return true;
}

int GracefulEnd::signal() const
{
    const std::lock_guard lock(mutex_);
    return signal_;
}

void GracefulEnd::wait()
{
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, std::chrono::duration<double>(grace_), [&] { return is_over_; })) return;
    const int signal = signal_;
    lock.unlock();
    end_now_(signal);
}

}  // namespace rapid

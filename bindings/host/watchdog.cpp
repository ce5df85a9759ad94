#include "bindings/host/watchdog.h"
#include "runtime/base/setting_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace rapid {
namespace {

// Returns the duration, capped at the clock's range, which exceeds any run.
std::chrono::steady_clock::duration duration_of(double seconds)
{
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(std::min(seconds, 1e7)));
}

}  // namespace

Watchdog::Watchdog(double limit, OnTimeout on_timeout)
    : limit_(limit), on_timeout_(std::move(on_timeout)), thread_([this] { watch(); })
{
}

Watchdog::~Watchdog()
{
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

// The watchdog need not be woken: it always sleeps for less than a section may take.
Watchdog::Section::Section(Watchdog& watchdog, std::string what) : watchdog_(watchdog)
{
    const std::lock_guard lock(watchdog.mutex_);
    const auto now = std::chrono::steady_clock::now();
    const auto limit = duration_of(watchdog.limit_);
    const auto others = now + limit * static_cast<int>(watchdog.running_.size());
    watchdog.deadline_ = std::clamp(watchdog.deadline_, now, others) + limit;
    watchdog.running_.push_back(std::move(what));
}

Watchdog::Section::~Section()
{
    const std::lock_guard lock(watchdog_.mutex_);
    watchdog_.running_.pop_back();  // sections end in reverse order; it does not matter whose name is removed
}

// The thread wakes up often. If it wakes much later than intended, the process was suspended (SIGSTOP, a sleeping
// machine), and no script ran in the meantime.
void Watchdog::watch()
{
    const auto step = std::min<std::chrono::steady_clock::duration>(std::chrono::seconds(1), duration_of(limit_ / 4));
    std::unique_lock lock(mutex_);
    while (!stop_) {
        const auto now = std::chrono::steady_clock::now();
        if (running_.empty() || now < deadline_) {
            const auto then = running_.empty() ? now + step : std::min(deadline_, now + step);
            wake_.wait_until(lock, then);
            if (const auto overslept = std::chrono::steady_clock::now() - then; overslept > step)
                deadline_ += overslept;
            continue;
        }
        const std::string message = fmt::format("{}: the script ran for more than {:g} s; {} sets the limit",
                                                fmt::join(running_, ", "), limit_, name_of(Setting::ScriptSeconds));
        if (on_timeout_(message) == EndProcess) {
            std::fprintf(stderr, "%s\n", message.c_str());
            std::_Exit(1);
        }
        deadline_ = now + duration_of(limit_);
    }
}

}  // namespace rapid

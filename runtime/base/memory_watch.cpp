#include "runtime/base/memory_watch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "runtime/base/memory_budget.h"
#include "runtime/base/setting_names.h"

namespace rapid {
namespace {

constexpr double look_seconds = 0.005;  // a run allocates about 10 MB in this time
constexpr double grace_seconds = 1;

// The memory of the process except for mapped files and libraries, which the system can drop.
class OwnMemory {
public:
    OwnMemory() : file_(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC)) {}
    ~OwnMemory()
    {
        if (file_ >= 0) ::close(file_);
    }
    OwnMemory(const OwnMemory&) = delete;
    OwnMemory& operator=(const OwnMemory&) = delete;

    // Returns 0 if the system does not report it.
    std::uint64_t bytes() const
    {
        std::array<char, 128> text{};
        unsigned long resident = 0, shared = 0;
        if (::pread(file_, text.data(), text.size() - 1, 0) <= 0) return 0;
        if (std::sscanf(text.data(), "%*u %lu %lu", &resident, &shared) != 2) return 0;
        return (resident - std::min(resident, shared)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    }

private:
    int file_;
};

}  // namespace

MemoryWatch::MemoryWatch(std::uint64_t at_first, Callback on_exceeded, Callback on_overrun)
    : on_exceeded_(std::move(on_exceeded)), on_overrun_(std::move(on_overrun))
{
    if (!is_memory_limited()) return;
    const std::uint64_t most = std::max(memory_budget(), at_first + 2 * negligible_memory);
    thread_ = std::thread([this, most] { watch(most); });
}

MemoryWatch::~MemoryWatch()
{
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

std::uint64_t MemoryWatch::now() { return OwnMemory().bytes(); }

bool MemoryWatch::ends_within(double seconds)
{
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return is_over_; });
}

void MemoryWatch::watch(std::uint64_t most)
{
    const OwnMemory memory;
    std::uint64_t bytes = 0;
    do {
        if (ends_within(look_seconds)) return;
        bytes = memory.bytes();
        if (bytes <= most) continue;
        malloc_trim(0);  // returns freed memory, which the process still holds
        bytes = memory.bytes();
    } while (bytes <= most);

    Error error("out of memory", ErrorKind::OutOfMemory);
    try {
        error = error.reworded(fmt::format(
            "the run uses {} of memory, and the limit is {}; use fewer points, pairs, voxels or strings, or set {}",
            memory_text(static_cast<double>(bytes)), memory_text(static_cast<double>(most)), name_of(Setting::Memory)));
        on_exceeded_(error);
    } catch (const std::exception&) {  // this thread has no caller
    }
    if (!on_overrun_) return;
    for (double waited = 0; waited < grace_seconds && memory.bytes() <= most + most / 16; waited += look_seconds)
        if (ends_within(look_seconds)) return;
    try {
        on_overrun_(error);
    } catch (const std::exception&) {
    }
}

}  // namespace rapid

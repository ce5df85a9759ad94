// Ends a run that exceeds its memory budget because an allocation was not estimated, or estimated too low.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "runtime/base/error.h"

namespace rapid {

class MemoryWatch {
public:
    using Callback = std::function<void(const Error& error)>;

    // Watches the process during its lifetime if a budget is set (memory_budget.h). The limit is at least 128 MiB above
    // `at_first`, because two allocations too small to be checked may coincide. Both functions are called from a
    // separate thread, at most once, and their exceptions are ignored. `on_exceeded` asks the run to end. `on_overrun`,
    // if set, is called if the run has not ended within a second or continues to grow.
    MemoryWatch(std::uint64_t at_first, Callback on_exceeded, Callback on_overrun);
    ~MemoryWatch();
    MemoryWatch(const MemoryWatch&) = delete;
    MemoryWatch& operator=(const MemoryWatch&) = delete;

    // Returns the current memory of the process without mapped files.
    static std::uint64_t now();

private:
    void watch(std::uint64_t most);
    bool ends_within(double seconds);

    const Callback on_exceeded_, on_overrun_;
    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_over_ = false;
    std::thread thread_;
};

}  // namespace rapid

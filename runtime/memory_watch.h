// Ends a run that takes more memory than its budget: what nobody estimated, or what was estimated too low.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace rapid {

class MemoryWatch {
public:
    using Tell = std::function<void(const std::string& message)>;

    // Watches the process for as long as it lives, where the budget is set (memory_budget.h). Whatever that is, 128 MiB
    // more than `at_first` are let pass: what is not asked for may come twice. Both are called from a thread of its
    // own, at most once; what they throw, for want of memory, is dropped. beyond: asks the run to end. too_late, if
    // set: the run has not ended within a second, or goes on to grow.
    MemoryWatch(std::uint64_t at_first, Tell beyond, Tell too_late);
    ~MemoryWatch();
    MemoryWatch(const MemoryWatch&) = delete;
    MemoryWatch& operator=(const MemoryWatch&) = delete;

    // Bytes that the process has now, but for files that are mapped.
    static std::uint64_t now();

private:
    void watch(std::uint64_t most);
    bool ends_within(double seconds);

    const Tell beyond_, too_late_;
    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_over_ = false;
    std::thread thread_;
};

}  // namespace rapid

// The error of a parallel loop over points. Of all errors thrown, it keeps the one that a serial loop would have thrown
// first, so that it does not depend on scheduling.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>

namespace rapid {

class FirstError {
public:
    // Runs f, the part of a loop that begins at `point`. `loop` numbers loops that would run one after the other.
    // Returns false if f throws. Also returns false, without running f, if an earlier point already has an error.
    template <class F>
    bool guard(std::size_t loop, std::size_t point, const F& f)
    {
        const std::uint64_t index = std::uint64_t{loop} << 48 | point;
        if (index > index_.load(std::memory_order_relaxed)) return false;
        try {
            f();
            return true;
        } catch (...) {
            const std::lock_guard lock(mutex_);
            if (index < index_) {
                index_ = index;
                error_ = std::current_exception();
            }
            return false;
        }
    }

    void rethrow() const
    {
        if (error_) std::rethrow_exception(error_);
    }

private:
    std::mutex mutex_;
    std::atomic<std::uint64_t> index_{UINT64_MAX};
    std::exception_ptr error_;
};

}  // namespace rapid

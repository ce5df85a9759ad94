// Ends what runs, from another thread, within loops too: they ask at each chunk of points and at each sub-step.
#pragma once

#include <atomic>

#include "runtime/error.h"

namespace rapid {

class Cancellation {
public:
    static constexpr char text[] = "the run was cancelled";

    // From any thread. What has asked then ends with an Error of the text above.
    void request() { requested_.store(true, std::memory_order_relaxed); }
    void forget() { requested_.store(false, std::memory_order_relaxed); }
    bool is_requested() const { return requested_.load(std::memory_order_relaxed); }
    // Error: it has been requested.
    void check() const
    {
        if (is_requested()) throw Error(text);
    }

    // That of what this thread runs; null: none.
    static const Cancellation* current();
    // Error: that of what this thread runs has been requested.
    static void check_current();

    // Makes it that of what this thread runs, for as long as it lives. Loops over chunks hand it to their threads.
    class Scope {
    public:
        explicit Scope(const Cancellation* cancellation);
        ~Scope();
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        const Cancellation* before_;
    };

private:
    std::atomic<bool> requested_ = false;
};

}  // namespace rapid

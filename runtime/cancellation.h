// Ends what runs, from another thread, within loops too: they ask at each chunk of points and at each sub-step.
#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "runtime/error.h"

namespace rapid {

class Cancellation {
public:
    static constexpr char text[] = "the run was cancelled";

    // From any thread. What asks then ends with an Error that says why; the first text counts.
    void request(const std::string& why = text);
    void forget();
    bool is_requested() const { return requested_.load(std::memory_order_relaxed); }
    // Error: it has been requested.
    void check() const
    {
        if (is_requested()) fail();
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

    // The node that this thread evaluates, for as long as it lives, for those who end the thread from outside.
    class Place {
    public:
        Place(const std::string& node, const Location& location);
        ~Place();
        Place(const Place&) = delete;
        Place& operator=(const Place&) = delete;

    private:
        const Cancellation* const of_;
        const Place* before_ = nullptr;
        const std::string& node_;
        const Location& location_;
        friend class Cancellation;
    };
    // An error of the node that is evaluated now, if there is one.
    Error error(const std::string& message) const;

private:
    [[noreturn]] void fail() const;

    std::atomic<bool> requested_ = false;
    mutable std::mutex mutex_;
    std::string why_;
    mutable const Place* place_ = nullptr;
};

}  // namespace rapid

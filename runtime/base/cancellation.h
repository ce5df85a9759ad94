// Cancels a run from another thread, also within loops: they check at each chunk of points and at each substep.
#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "runtime/base/error.h"

namespace rapid {

class Cancellation {
public:
    // The error that is thrown if there is no other reason.
    static Error cancelled() { return Error("the run was cancelled", ErrorKind::Cancelled); }

    // From any thread. Whoever asks afterwards ends with this error; the first one counts.
    void request(const Error& why = cancelled());
    void forget();
    bool is_requested() const { return requested_.load(std::memory_order_relaxed); }
    // Throws Error if cancellation has been requested.
    void check() const
    {
        if (is_requested()) fail();
    }

    // Returns the cancellation of this thread's run, or null.
    static const Cancellation* current();
    // Throws Error if the cancellation of this thread's run has been requested.
    static void check_current();

    // Makes a cancellation current for this thread during its lifetime. Loops over chunks pass it on to their threads.
    class Scope {
    public:
        explicit Scope(const Cancellation* cancellation);
        ~Scope();
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        const Cancellation* before_;
    };

    // Records the node that this thread evaluates during its lifetime, for code that ends the thread from outside.
    class NodeScope {
    public:
        NodeScope(const std::string& node, const Location& location);
        ~NodeScope();
        NodeScope(const NodeScope&) = delete;
        NodeScope& operator=(const NodeScope&) = delete;

    private:
        const Cancellation* const of_;
        const NodeScope* before_ = nullptr;
        const std::string& node_;
        const Location& location_;
        friend class Cancellation;
    };
    // The error, at the node that is evaluated now, if there is one.
    Error placed(Error error) const;

private:
    [[noreturn]] void fail() const;

    std::atomic<bool> requested_ = false;
    mutable std::mutex mutex_;
    Error why_ = cancelled();
    mutable const NodeScope* scope_ = nullptr;
};

}  // namespace rapid

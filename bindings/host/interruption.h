// Stops the scripts of a session from another thread, wherever they are, without ending the process.
//
// A hook stops the interpreter at its next instruction with an ordinary error. Compiled code checks no hook: a signal
// handler leaves an endless loop in it by a jump, if no C++ frame lies in between. After the jump the Lua state is
// invalid: it is not used again, and its memory is leaked.
#pragma once

#include <setjmp.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "runtime/base/error.h"

struct lua_Debug;
struct lua_State;

namespace rapid {

class Interruption {
public:
    Interruption() = default;
    ~Interruption();
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;

    // Stops running scripts and refuses later ones with this error. The first error wins. Callable from any thread.
    void request(const Error& why);
    bool is_requested() const { return is_requested_.load(); }
    // Throws the error if it has been requested.
    void check() const;
    // Precondition: it has been requested.
    const Error& why() const { return why_; }

    // A Lua state and the thread that runs in it.
    class Slot {
    public:
        explicit Slot(Interruption& owner);
        ~Slot();
        Slot(const Slot&) = delete;
        Slot& operator=(const Slot&) = delete;

    private:
        friend class Interruption;
        Interruption& owner_;
        pthread_t thread_{};
        std::atomic<int> calls_ = 0;  // nested calls of that thread
    };

    // A call of Lua: `if (sigsetjmp(call.jump_target, 0) == 0) lua_pcall(...) else call.after_jump()`. Takes no lock.
    class Call {
    public:
        // Throws if an interruption has been requested.
        Call(Slot& slot, lua_State* L);
        ~Call();
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

        // Called after the jump.
        void after_jump() const;
        // Jumps out of this thread's innermost call if it belongs to the slot and no C++ frame lies in between.
        static void try_to_leave(const Slot& slot);
        // Does the same from a C++ function whose objects are already destroyed, if the call belongs to the slot.
        static void leave(const Slot& slot);

        sigjmp_buf jump_target;

    private:
        friend class Interruption;
        void end();

        Slot& slot_;
        lua_State* const lua_;
        Call* const outer_;
        std::atomic<int> natives_ = 0;  // C++ functions between the call and the running code
    };

    // A C++ function called by Lua: no jump crosses it while it runs.
    class InNative {
    public:
        InNative();
        ~InNative();

    private:
        Call* call_;
    };

private:
    static void install_handler();
    static void on_signal(int signal, siginfo_t* info, void* context);
    static void stop(lua_State* L, lua_Debug* where);
    void signal_until_over();

    std::atomic<bool> is_requested_ = false;
    std::atomic<bool> jumps_ = false;  // the hooks have had time to act
    bool is_any_running() const;

    std::mutex mutex_;
    std::condition_variable stopping_;
    std::set<const Slot*> slots_;
    Error why_{""};  // set once, before is_requested_
    bool stop_ = false;
    std::thread thread_;  // started by the first request
};

// The watchdog of --script-timeout: a thread that detects when a script overruns, even in compiled code.
class Watchdog {
public:
    enum Reaction { EndProcess, Continue };
    using OnTimeout = std::function<Reaction(const std::string& message)>;

    // limit: seconds that a section may take. on_timeout: called from the watchdog's thread, repeatedly while a late
    // section lasts. If it returns EndProcess, the process ends with the message on standard error.
    Watchdog(double limit, OnTimeout on_timeout);
    ~Watchdog();

    // A stretch of script whose time counts. Concurrent sections each get as much time as if they ran alone.
    class Section {
    public:
        Section(Watchdog& watchdog, std::string what);
        ~Section();

    private:
        Watchdog& watchdog_;
    };

private:
    void watch();

    const double limit_;
    const OnTimeout on_timeout_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<std::string> running_;
    std::chrono::steady_clock::time_point deadline_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace rapid

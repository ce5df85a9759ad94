// Stops the scripts of a session from another thread, wherever they are, and the process goes on.
//
// The interpreter is stopped by a hook, at its next instruction; it raises an ordinary error. Compiled code asks for no
// hook: a loop in it that never ends is left by a jump from a signal's handler, where nothing of C++ is in between.
// What the jump leaves behind is no valid state of Lua: it is not used again, and its memory is lost.
#pragma once

#include <setjmp.h>
#include <signal.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>

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

    // Stops what runs, and refuses what would run later, with this error. The first one counts. From any thread.
    void request(const Error& why);
    bool is_requested() const { return is_requested_.load(); }
    // Throws the error if it has been requested.
    void check() const;
    // Precondition: it has been requested.
    const Error& why() const { return why_; }

    // A state of Lua, and the thread that runs in it.
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
        std::atomic<int> calls_ = 0;  // one within the other, by that thread
    };

    // A call of Lua: `if (sigsetjmp(call.place, 0) == 0) lua_pcall(...) else call.has_left()`. Takes no lock.
    class Call {
    public:
        // Error: an interruption has been requested.
        Call(Slot& slot, lua_State* L);
        ~Call();
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

        // After the jump.
        void has_left() const;
        // Jumps out of the innermost call of this thread, if it is one of the slot and nothing of C++ is in between.
        static void try_to_leave(const Slot& slot);
        // The same, from a function of C++ whose objects are gone by now, if the call is one of the slot.
        static void leave(const Slot& slot);

        sigjmp_buf place;

    private:
        friend class Interruption;
        void end();

        Slot& slot_;
        lua_State* const lua_;
        Call* const outer_;
        std::atomic<int> natives_ = 0;  // functions of C++ between the call and what runs
    };

    // A function of C++ that Lua has called: while it runs nobody jumps over it.
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
    std::atomic<bool> jumps_ = false;  // the hooks have had their time
    bool is_any_running() const;

    std::mutex mutex_;
    std::condition_variable stopping_;
    std::set<const Slot*> slots_;
    Error why_{""};  // set once, before is_requested_
    bool stop_ = false;
    std::thread thread_;  // made by the first request
};

}  // namespace rapid

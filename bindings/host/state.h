// A LuaJIT state that has run the graph file: the session's main state, or a worker's.
//
// The graph's code sees the restricted environment of lua/sandbox.lua and objects without addresses. A worker's state
// runs the same file only for its kernels: every constructor returns the object of the main state's call, by the order
// of calls, so that no mesh is read and no level set built twice.
#pragma once

#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/host/interruption.h"
#include "runtime/base/error.h"

struct lua_State;
struct rapid_chunk;  // lua/chunk.h

namespace rapid {

class KernelLanes;
class ScriptHost;

class State {
public:
    State(ScriptHost& host, bool main);
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    static State& of(lua_State* L);

    // Returns the running coroutine, or the main thread of the state.
    lua_State* lua() const { return L_; }
    ScriptHost& host() const { return host_; }
    bool is_main() const { return main_; }

    // Calls the function below its `arguments` on the stack. Throws the error that it raised, at the nearest line of
    // graph code; the stack is then as before the function was pushed.
    void call(int arguments, int results);

    // Notes an Error that goes on as a Lua error: Lua knows its text alone.
    void pass(const Error& error);
    // The kind of an error that came out of Lua with this text: that of the last Error that was passed, or of the
    // interruption, if the text contains theirs.
    ErrorKind kind_of(const std::string& text) const;

    // If a nested call was left by a jump, leaves the outer call, too, since Lua cannot return into it. Functions that
    // Lua has called must call this after their C++ objects are destroyed.
    void leave_if_broken() const;

    // Pushes an entry point of lua/host.lua.
    void push_entry(const char* name);
    // Pushes the function of a kernel, by its number.
    void push_kernel(std::size_t kernel);
    // Returns true if the graph's body has run.
    bool is_loaded() const { return loaded_; }
    void set_loaded();

    // While a kernel runs, graph code may not make objects.
    bool runs_kernel() const { return runs_kernel_; }
    class InKernel {
    public:
        explicit InKernel(State& state) : state_(state) { state_.runs_kernel_ = true; }
        ~InKernel() { state_.runs_kernel_ = false; }

    private:
        State& state_;
    };

    // Makes L the running coroutine, whose own stack holds the arguments of a native function.
    class InCoroutine {
    public:
        InCoroutine(State& state, lua_State* L) : state_(state), before_(state.L_) { state_.L_ = L; }
        ~InCoroutine() { state_.L_ = before_; }

    private:
        const Interruption::InNative in_native_;
        State& state_;
        lua_State* before_;
    };

    // Pops the function at the top of the stack, and stores it as the next kernel.
    std::size_t add_kernel();
    std::size_t kernel_count() const { return kernel_references_.size(); }

    // number of the next constructor call
    std::size_t next_made = 0;

    // Runs a kernel over points in this state (lua/kernel.lua), for columns of one layout: functions in the registry,
    // and the chunk that they see, followed by pointers to columns.
    struct Runner {
        std::string layout;
        int run = 0, set_params = 0;
        rapid_chunk* chunk = nullptr;
        std::uint64_t pass = 0;  // the pass whose parameters it has
        int translate = 0;       // makes the kernel a program of lanes, once it has parameters
        std::unique_ptr<KernelLanes> lanes;
    };
    std::map<std::size_t, std::vector<Runner>> runners;  // by kernel

    // Number of the running :detail function. It changes when that function ends (lua/detail.lua).
    std::int32_t detail_serial = 0;

    // The tail call that ends the body of the running file, `return ...:solve {}`. It leaves no stack frame that would
    // show its position. Line 0 means none.
    Location tail_call;

    // Bytes of Lua memory in use.
    std::size_t memory() const { return memory_; }
    // Returns the message for a script that exceeds its memory limit.
    std::string memory_limit_text() const;

private:
    Error beyond_limit() const;
    // Marks a protected call of Lua, in which its errors can be caught.
    class Protected {
    public:
        explicit Protected(State& state) : state_(state), before_(std::exchange(state.protected_, true)) {}
        ~Protected() { state_.protected_ = before_; }

    private:
        State& state_;
        const bool before_;
    };

    static void* allocate(void* self, void* block, std::size_t old_size, std::size_t new_size);
    int protected_call(int arguments, int results, int handler);
    [[noreturn]] void fail_broken() const;
    // Makes the LuaJIT state; leaves none if memory runs out.
    void make();
    // Fills a new state. Returns the error, if any.
    std::exception_ptr set_up();
    void close();
    void open_libraries();
    void run_host_file();

    ScriptHost& host_;
    bool main_;
    std::size_t memory_ = 0;
    bool loaded_ = false, runs_kernel_ = false;
    bool limited_ = false;        // to options().script_memory, at present
    bool has_libraries_ = false;  // LuaJIT's own libraries, ffi included
    bool is_broken_ = false;      // compiled code was left by a jump
    bool is_at_limit_ = false;    // memory was last refused because the script exceeded its limit
    bool protected_ = false;      // now
    std::string passed_;          // the text of the last Error that was passed, unless it was a fault
    ErrorKind passed_kind_ = ErrorKind::Fault;
    std::jmp_buf* making_ = nullptr;  // jump target while LuaJIT makes the state, if memory runs out
    Interruption::Slot slot_;
    lua_State* L_ = nullptr;
    int entries_ = 0;
    std::vector<int> kernel_references_;
};

// Distinguishes memory requests of code that LuaJIT compiled from those of its interpreter.
//
// If a request fails, LuaJIT looks for the running function to put its error on that function's stack. While compiled
// code runs, the interpreter's position is out of date: LuaJIT may find something there that is not a function, and
// crash.

// Returns true if compiled code made the current request. Call it below LuaJIT's allocator. It allocates nothing.
bool is_called_by_compiled_code();

}  // namespace rapid

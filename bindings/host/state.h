// One LuaJIT state that has run the graph file: the session's main state, or a worker's.
//
// The graph's code sees the restricted environment of lua/sandbox.lua and objects without addresses. A worker's state
// runs the same file for its kernels alone: every constructor returns what the main state's call made, by the order of
// calls, so that no mesh is read and no level set built twice.
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

    // The running coroutine, or the main thread of the state.
    lua_State* lua() const { return L_; }
    ScriptHost& host() const { return host_; }
    bool is_main() const { return main_; }

    // Calls the function below its `arguments` on the stack. Error: the one that it raised, at the nearest line of
    // graph code; the stack is then as before the function was pushed.
    void call(int arguments, int results);

    // Notes an Error that goes on as a Lua error: Lua knows its text alone.
    void pass(const Error& error);
    // The kind of an error that came out of Lua with this text: that of the last Error that was passed, or of the
    // interruption, if the text contains theirs.
    ErrorKind kind_of(const std::string& text) const;

    // Where a call within another one was left by a jump: leaves the other one, too, as Lua can't return into it. To be
    // called by functions that Lua has called, behind their objects of C++.
    void leave_if_broken() const;

    // Pushes an entry point of lua/host.lua.
    void push_entry(const char* name);
    // Pushes the function of a kernel, by its number.
    void push_kernel(std::size_t kernel);
    // Whether the graph's body has run.
    bool is_loaded() const { return loaded_; }
    void set_loaded();

    // While a kernel works on points, graph code makes nothing.
    bool runs_kernel() const { return runs_kernel_; }
    class InKernel {
    public:
        explicit InKernel(State& state) : state_(state) { state_.runs_kernel_ = true; }
        ~InKernel() { state_.runs_kernel_ = false; }

    private:
        State& state_;
    };

    // Makes L the running coroutine: it has a stack of its own, where the arguments of a native function are.
    class InCoroutine {
    public:
        InCoroutine(State& state, lua_State* L) : state_(state), before_(state.L_) { state_.L_ = L; }
        ~InCoroutine() { state_.L_ = before_; }

    private:
        const Interruption::InNative in_native_;
        State& state_;
        lua_State* before_;
    };

    // Keeps the function at the top of the stack as the next kernel, and takes it off.
    std::size_t add_kernel();
    std::size_t kernel_count() const { return kernel_references_.size(); }

    // The number of the next constructor call.
    std::size_t next_made = 0;

    // Carries a kernel over points in this state (lua/kernel.lua), for columns of one layout: functions in the
    // registry, and the chunk that they see, with pointers to columns behind it.
    struct Runner {
        std::string layout;
        int run = 0, set_params = 0;
        rapid_chunk* chunk = nullptr;
        std::uint64_t pass = 0;  // whose parameters it has been given
        int translate = 0;       // makes the kernel a program of lanes; once it has parameters
        std::unique_ptr<KernelLanes> lanes;
    };
    std::map<std::size_t, std::vector<Runner>> runners;  // by kernel

    // Number of the running :detail function; it changes when that ends (lua/detail.lua).
    std::int32_t detail_serial = 0;

    // The call that ends the body of the running file, `return ...:solve {}`: it leaves no frame on the stack that
    // would tell its place. Line 0: none.
    Location tail_call;

    // Bytes of Lua memory in use.
    std::size_t memory() const { return memory_; }
    // What a script is told that needs more than it may have.
    std::string memory_limit_text() const;

private:
    Error beyond_limit() const;
    // While Lua runs in a protected call, its errors have somewhere to go.
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
    // Has LuaJIT make the state; none where there is no memory.
    void make();
    // Fills a new state; the error, where there is one.
    std::exception_ptr set_up();
    void close();
    void open_libraries();
    void run_host_file();

    ScriptHost& host_;
    bool main_;
    std::size_t memory_ = 0;
    bool loaded_ = false, runs_kernel_ = false;
    bool limited_ = false;        // to options().script_memory, now
    bool has_libraries_ = false;  // those of LuaJIT itself
    bool is_broken_ = false;      // compiled code was left by a jump
    bool is_at_limit_ = false;    // memory was last refused as the script asked for more than it may have
    bool protected_ = false;      // now
    std::string passed_;          // the text of the last Error that was passed, unless it was a fault
    ErrorKind passed_kind_ = ErrorKind::Fault;
    std::jmp_buf* making_ = nullptr;  // while LuaJIT makes the state: where to go without memory
    Interruption::Slot slot_;
    lua_State* L_ = nullptr;
    int entries_ = 0;
    std::vector<int> kernel_references_;
};

}  // namespace rapid

// One LuaJIT state that has run the graph file: the session's main state, or a worker's.
//
// The graph's code sees the restricted environment of lua/sandbox.lua and objects without addresses. A worker's state
// runs the same file for its kernels alone: every constructor returns what the main state's call made, by the order of
// calls, so that no mesh is read and no level set built twice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/error.h"
#include "runtime/graph/value.h"

struct lua_State;
struct rapid_chunk;  // lua/chunk.h

namespace rapid {

class ScriptHost;

class State {
public:
    State(ScriptHost& host, bool main);
    ~State();
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    static State& of(lua_State* L);

    // The coroutine that runs now, or the main thread of the state.
    lua_State* lua() const { return L_; }
    ScriptHost& host() const { return host_; }
    bool is_main() const { return main_; }

    // Calls the function below its `arguments` on the stack. Error: what it raised, at the nearest line of graph code;
    // the stack is then as before the function was pushed.
    void call(int arguments, int results);

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

    // Keeps the function at the top of the stack as the next kernel, and takes it off.
    std::size_t add_kernel();
    std::size_t kernel_count() const { return kernel_references_.size(); }

    // Between Lua and the runtime's values. Functions become FrameFunctions (main state only).
    Value to_value(int index);
    void push(const Value& value);
    void push_object(const ObjectPtr& object);
    // Null where the value is no object of ours.
    ObjectPtr to_object(int index);

    // The nearest place of graph code on the stack.
    Location where() const;

    // The number of the next constructor call.
    std::size_t next_made = 0;

    // What carries a kernel over points in this state (lua/kernel.lua), for columns of one layout: functions in the
    // registry, and the chunk that they see, with pointers to columns behind it.
    struct Runner {
        std::string layout;
        int run = 0, set_params = 0;
        rapid_chunk* chunk = nullptr;
        std::uint64_t pass = 0;  // whose parameters it has been given
    };
    std::map<std::size_t, std::vector<Runner>> runners;  // by kernel

    // Of the :detail function that runs, and another one when it has ended (lua/detail.lua).
    std::int32_t detail_serial = 0;

    // The place of the call that ends the body of the file that runs, `return ...:solve {}`: it leaves no frame behind
    // for where(). Line 0: none.
    Location tail_call;

    // Bytes of Lua memory in use.
    std::size_t memory() const { return memory_; }

private:
    friend int guarded(lua_State* L, int (*f)(State& state));
    static void* allocate(void* self, void* block, std::size_t old_size, std::size_t new_size);
    void open_libraries();
    void register_natives();

    ScriptHost& host_;
    bool main_;
    std::size_t memory_ = 0;
    bool loaded_ = false, runs_kernel_ = false;
    bool limited_ = false;  // to options().script_memory, now
    lua_State* L_ = nullptr;
    int entries_ = 0;
    std::vector<int> kernel_references_;
};

// native.run(chunk, file, line, ...): calls the body of a file, or the scene of a study with its knobs, which ends in a
// call at that line, or in none (nil).
int run_body(lua_State* L);

// Runs f and turns an Error into a Lua error with the place of the calling graph code. For functions that Lua calls.
int guarded(lua_State* L, int (*f)(State& state));

}  // namespace rapid

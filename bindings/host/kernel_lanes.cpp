#include "bindings/host/kernel_lanes.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>
#include <string>
#include <utility>

#include "bindings/host/kernel_functions.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_host.h"

namespace rapid {
namespace {

constexpr std::size_t max_inputs = 200;

// The functions below read fields of the table at the top of the stack.

double number_at(lua_State* L, int index)
{
    lua_rawgeti(L, -1, index);
    const double number = lua_tonumber(L, -1);
    lua_pop(L, 1);
    return number;
}

template <class Use>
void each_element(lua_State* L, const char* field, const Use& use)
{
    lua_getfield(L, -1, field);
    const int size = static_cast<int>(lua_objlen(L, -1));
    for (int k = 1; k <= size; ++k) {
        lua_rawgeti(L, -1, k);
        use();
        lua_pop(L, 1);
    }
    lua_pop(L, 1);
}

std::size_t size_of(lua_State* L, const char* field)
{
    lua_getfield(L, -1, field);
    const auto size = static_cast<std::size_t>(lua_tonumber(L, -1));
    lua_pop(L, 1);
    return size;
}

template <class Functions, class List>
void add_functions(lua_State* L, const char* field, const Functions& known, List& list)
{
    each_element(L, field, [&] {
        const std::string name = text_at(L, -1);
        for (const auto& [known_name, function] : known)
            if (known_name == name) list.push_back(function);
    });
}

std::vector<LaneInstruction> instructions_of(lua_State* L, const char* field)
{
    std::vector<LaneInstruction> code;
    each_element(L, field, [&] {
        lua_getfield(L, -1, "op");
        const LaneOperation operation = lane_operation(text_at(L, -1));
        lua_pop(L, 1);
        const auto operand = [&](int index) { return static_cast<std::uint16_t>(number_at(L, index)); };
        if (!operation) throw Error("lua/lanes.lua returned an unknown operation");
        code.push_back({operation, operand(1), operand(2), operand(3), operand(4), operand(5)});
    });
    return code;
}

LaneProgram program_of(lua_State* L)
{
    LaneProgram program;
    each_element(L, "constants", [&] { program.constants.push_back(lua_tonumber(L, -1)); });
    program.inputs = size_of(L, "inputs");
    program.slots = size_of(L, "slots");
    program.shared = instructions_of(L, "shared");
    program.steady = instructions_of(L, "steady");
    program.steady_column = static_cast<std::uint16_t>(size_of(L, "steady_column"));
    program.code = instructions_of(L, "code");
    add_functions(L, "functions1", math_functions1, program.functions1);
    add_functions(L, "functions2", math_functions2, program.functions2);
    return program;
}

}  // namespace

KernelLanes::KernelLanes(State& state, const KernelLayout& layout, const Location& location)
    : columns_(layout.columns.size())
{
    const auto id = std::find_if(layout.columns.begin(), layout.columns.end(),
                                 [](const KernelLayout::Entry& entry) { return entry.name == "id"; });
    id_ = static_cast<std::size_t>(id - layout.columns.begin());
    state.call(0, 2);
    lua_State* const L = state.lua();
    const std::string reason = lua_isstring(L, -1) ? text_at(L, -1) : "it uses many numbers that all points share";
    lua_pop(L, 1);
    if (lua_istable(L, -1) && size_of(L, "inputs") <= max_inputs) {
        program_ = program_of(L);
        lua_getfield(L, -1, "kills");
        kills_ = lua_toboolean(L, -1) != 0;
        lua_pop(L, 1);
        lua_getfield(L, -1, "inputs_now");
        inputs_now_ = luaL_ref(L, LUA_REGISTRYINDEX);
    } else if (const auto& callback = state.host().options().on_no_lanes) {
        callback(fmt::format("{}:{}: {}", location.file, location.line, reason));
    }
    lua_pop(L, 1);
}

bool KernelLanes::is_ready(State& state, const rapid_chunk& chunk, std::uint64_t pass)
{
    constexpr std::size_t first_tiles = 64;
    if (!program_ || (kills_ && !chunk.kill)) return false;
    if (tiles_ > first_tiles && failed_tiles_ > tiles_ / 4) return false;
    if (pass_ != pass) find_inputs(state);
    pass_ = pass;
    return has_inputs_;
}

void KernelLanes::find_inputs(State& state)
{
    lua_State* const L = state.lua();
    const int results = static_cast<int>(program_->inputs) + 1;
    luaL_checkstack(L, results + 2, "for the inputs of a kernel");
    lua_rawgeti(L, LUA_REGISTRYINDEX, inputs_now_);
    state.call(0, results);
    has_inputs_ = lua_toboolean(L, -results) != 0;
    inputs_.clear();
    for (int k = 1; has_inputs_ && k < results; ++k) inputs_.push_back(lua_tonumber(L, k - results));
    lua_pop(L, results);
}

void KernelLanes::run(const rapid_chunk& chunk, std::span<const LaneChunk::Memory> memory,
                      const std::function<void(std::int32_t begin, std::int32_t end)>& failed)
{
    LaneChunk over;
    over.size = static_cast<std::size_t>(chunk.size);
    over.first = chunk.first;
    over.number = chunk.number;
    over.time = chunk.time;
    over.dt = chunk.dt;
    over.substep = chunk.substep;
    over.columns = memory.first(columns_);
    over.groups = memory.subspan(columns_);
    if (id_ < columns_) over.ids = memory[id_];
    over.random.value = chunk.random;
    over.kill = chunk.kill;
    over.result = chunk.result;
    over.members = chunk.members;
    over.times = chunk.times;
    over.steps = chunk.steps;
    over.inputs = inputs_;
    tiles_ += (over.size + LaneRunner::tile - 1) / LaneRunner::tile;
    runner_.run(*program_, over, [&](std::size_t begin, std::size_t end) {
        ++failed_tiles_;
        failed(static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end));
    });
}

}  // namespace rapid

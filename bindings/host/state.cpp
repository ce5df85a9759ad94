#include "bindings/host/state.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <lua.hpp>
#include <sstream>
#include <utility>

#include "bindings/host/natives.h"
#include "bindings/host/ramp.h"
#include "bindings/host/script_host.h"

namespace rapid {
namespace {

constexpr char object_metatable[] = "rapid.object";
constexpr int levels_searched = 50;  // for an error's own line, which `error(text, level)` may put further down
constexpr int cdata_type = 10;       // LUA_TCDATA, which lua.h does not name

std::string read_text(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(fmt::format("can't read {}: Rapid's own Lua files are missing", path.string()));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

// Chunk names of graph code begin with @ and are shown as they are; Rapid's own begin with =[rapid.
bool is_graph_code(const lua_Debug& info) { return info.source[0] == '@'; }

// Whether the frame is run_body(): if a file's body has left by a tail call, it would lie directly above it.
bool runs_body(lua_State* L, lua_Debug& info)
{
    if (*info.what != 'C') return false;
    lua_getinfo(L, "f", &info);
    const bool it_is = lua_tocfunction(L, -1) == run_body;
    lua_pop(L, 1);
    return it_is;
}

// Takes the error value on top and leaves a text: position and message. The position is that of the error's own line
// where it is in graph code, else the nearest line of graph code that led there.
int describe_error(lua_State* L)
{
    std::string message;
    if (lua_type(L, 1) == LUA_TSTRING || lua_type(L, 1) == LUA_TNUMBER) {
        std::size_t size = 0;
        const char* text = lua_tolstring(L, 1, &size);
        message.assign(text, size);
    } else if (lua_isnil(L, 1)) {
        message = "error raised without a message";
    } else {
        message = fmt::format("error raised with a {} instead of a message", luaL_typename(L, 1));
    }

    // Then Lua leaves no more than a few slots to whoever describes it.
    constexpr std::string_view of_overflow = "stack overflow";
    const bool overflow = message.size() >= of_overflow.size() &&
                          message.compare(message.size() - of_overflow.size(), of_overflow.size(), of_overflow) == 0;
    State& state = State::of(L);
    std::string place;
    lua_Debug info;
    for (int level = 1; lua_getstack(L, level, &info); ++level) {
        lua_getinfo(L, "Sl", &info);
        if (place.empty() && runs_body(L, info) && state.tail_call.line > 0)
            place = fmt::format("{}:{}", state.tail_call.file, state.tail_call.line);
        if (info.currentline < 0) continue;
        const std::string prefix = fmt::format("{}:{}: ", info.short_src, info.currentline);
        const bool own = message.rfind(prefix, 0) == 0;
        if (own) message.erase(0, prefix.size());
        if (is_graph_code(info) && (place.empty() || own))
            place = fmt::format("{}:{}", info.source + 1, info.currentline);
        if (own && is_graph_code(info)) break;
        if (!place.empty() && level > levels_searched) break;
    }
    if (place.empty() && state.tail_call.line > 0)
        place = fmt::format("{}:{}", state.tail_call.file, state.tail_call.line);
    // The language's own words for `p.v.x = 1`.
    if (message == "attempt to write to constant location")
        message = "neither a component nor the frame can be assigned; make a new vec3: p.v = vec3(1, p.v.y, p.v.z)";
    std::string trace;
    if (!overflow) {
        luaL_traceback(L, L, nullptr, 1);
        trace = lua_tostring(L, -1);
    }
    lua_settop(L, 0);
    lua_createtable(L, 3, 0);
    lua_pushlstring(L, message.data(), message.size());
    lua_rawseti(L, 1, 1);
    lua_pushlstring(L, place.data(), place.size());
    lua_rawseti(L, 1, 2);
    lua_pushlstring(L, trace.data(), trace.size());
    lua_rawseti(L, 1, 3);
    return 1;
}

std::string string_field(lua_State* L, int index, int key)
{
    lua_rawgeti(L, index, key);
    std::size_t size = 0;
    const char* text = lua_tolstring(L, -1, &size);
    std::string result(text ? text : "", text ? size : 0);
    lua_pop(L, 1);
    return result;
}

// "file:12" -> a Location.
Location parse_place(const std::string& place)
{
    const std::size_t colon = place.rfind(':');
    if (colon == std::string::npos) return {};
    return {place.substr(0, colon), std::atoi(place.c_str() + colon + 1)};
}

// A message that begins with a place, as load errors and those of nodes do, keeps it: "file:12: what".
Error with_place(const std::string& message, const std::string& place)
{
    const std::size_t end = message.find(": ");
    const std::size_t colon = end == std::string::npos ? end : message.rfind(':', end - 1);
    if (colon != std::string::npos && colon + 1 < end && message.find_first_not_of("0123456789", colon + 1) == end)
        return Error(message.substr(end + 2)).at(parse_place(message.substr(0, end)));
    if (!place.empty()) return Error(message).at(parse_place(place));
    return Error(message);
}

// An error that a native function raises inside Lua: an Error's message, with the place and node that it knew.
int raise(State& state, const std::string& message)
{
    lua_State* L = state.lua();
    lua_pushlstring(L, message.data(), message.size());
    return lua_error(L);
}

// A function of the frame: kept in the main state's registry while any node holds it.
class ScriptFunction : public FrameFunction {
public:
    ScriptFunction(State& state, int index) : state_(state)
    {
        lua_State* L = state.lua();
        lua_pushvalue(L, index);
        lua_Debug info;
        lua_pushvalue(L, -1);
        lua_getinfo(L, ">S", &info);
        if (is_graph_code(info)) location_ = {info.source + 1, info.linedefined};
        reference_ = luaL_ref(L, LUA_REGISTRYINDEX);
    }

    Value call(const Frame& frame) const override
    {
        lua_State* L = state_.lua();
        const ScriptHost::Section section(state_.host(),
                                          fmt::format("{}:{}: a parameter's function", location_.file, location_.line));
        made_.begin_call();
        struct Remembering {
            MadeBefore*& place;
            MadeBefore* before;
            ~Remembering() { place = before; }
        } const remembering{state_.host().made_before, std::exchange(state_.host().made_before, &made_)};
        state_.push_entry("call");
        lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
        lua_pushnumber(L, frame.number);
        lua_pushnumber(L, frame.time);
        lua_pushnumber(L, frame.dt);
        try {
            state_.call(4, 1);
        } catch (Error& error) {
            error.at(location_);
            throw;
        }
        Value result = state_.to_value(-1);
        lua_pop(L, 1);
        return result;
    }

private:
    State& state_;
    Location location_;
    int reference_ = 0;
    mutable MadeBefore made_;  // asked on one thread
};

}  // namespace

int guarded(lua_State* L, int (*f)(State& state))
{
    State& state = State::of(L);
    // A coroutine has a stack of its own, where the arguments are.
    struct Running {
        State& state;
        lua_State* before;
        ~Running() { state.L_ = before; }
    } const running{state, std::exchange(state.L_, L)};
    std::string message;
    try {
        return f(state);
    } catch (const Error& error) {
        message = error.what();
    } catch (const std::bad_alloc&) {
        message = "out of memory";
    } catch (const std::exception& error) {
        message = error.what();
    }
    return raise(state, message);
}

int run_body(lua_State* L)
{
    State& state = State::of(L);
    struct Ending {
        Location& place;
        Location before;
        ~Ending() { place = before; }
    } const ending{state.tail_call,
                   std::exchange(state.tail_call, {lua_tostring(L, 2), static_cast<int>(lua_tointeger(L, 3))})};
    lua_remove(L, 3);
    lua_remove(L, 2);
    lua_call(L, lua_gettop(L) - 1, 1);
    return 1;
}

State::State(ScriptHost& host, bool main) : host_(host), main_(main)
{
    L_ = lua_newstate(allocate, this);
    if (!L_) throw std::bad_alloc();
    lua_pushlightuserdata(L_, this);
    lua_setfield(L_, LUA_REGISTRYINDEX, "rapid.state");
    try {
        open_libraries();
        register_natives();
    } catch (...) {
        lua_close(L_);
        throw;
    }
}

State::~State() { lua_close(L_); }

State& State::of(lua_State* L)
{
    lua_getfield(L, LUA_REGISTRYINDEX, "rapid.state");
    State* state = static_cast<State*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return *state;
}

// Lua's memory of one state is limited while scripts run: a request beyond it is Lua's own "not enough memory". What
// the host itself puts on the stack between them is not: outside of a protected call that error would end the process.
void* State::allocate(void* self, void* block, std::size_t old_size, std::size_t new_size)
{
    State& state = *static_cast<State*>(self);
    if (new_size == 0) {
        std::free(block);
        state.memory_ -= old_size;
        return nullptr;
    }
    if (state.limited_ && new_size > old_size &&
        state.memory_ + (new_size - old_size) > state.host_.options().script_memory)
        return nullptr;
    void* moved = std::realloc(block, new_size);
    if (moved) state.memory_ += new_size - old_size;
    return moved;
}

void State::open_libraries()
{
    luaL_openlibs(L_);
    // Our modules are found in one folder, and named so that a position in them is never taken for graph code.
    const std::filesystem::path folder = lua_folder();
    for (const char* name :
         {"words", "vec3", "bytecode", "kernel", "detail", "numeric", "shape", "ramp", "sandbox", "study", "rapid"}) {
        lua_getglobal(L_, "package");
        lua_getfield(L_, -1, "preload");
        const std::string text = read_text(folder / (std::string(name) + ".lua"));
        if (luaL_loadbuffer(L_, text.data(), text.size(), fmt::format("=[rapid {}]", name).c_str()) != 0)
            throw Error(lua_tostring(L_, -1));
        lua_setfield(L_, -2, name);
        lua_pop(L_, 2);
    }
}

void State::register_natives()
{
    luaL_newmetatable(L_, object_metatable);
    lua_pushcfunction(L_, [](lua_State* L) -> int {
        static_cast<ObjectPtr*>(lua_touserdata(L, 1))->~ObjectPtr();
        return 0;
    });
    lua_setfield(L_, -2, "__gc");
    lua_pushboolean(L_, 0);
    lua_setfield(L_, -2, "__metatable");
    lua_pop(L_, 1);

    const std::filesystem::path folder = lua_folder();
    const std::string text = read_text(folder / "host.lua");
    if (luaL_loadbuffer(L_, text.data(), text.size(), "=[rapid host]") != 0) throw Error(lua_tostring(L_, -1));
    push_natives(*this, read_text(folder / "chunk.h"));
    call(1, 1);
    entries_ = luaL_ref(L_, LUA_REGISTRYINDEX);
    if (host_.options().on_trace_abort) {
        push_entry("watch_traces");
        call(0, 0);
    }
}

void State::call(int arguments, int results)
{
    const int base = lua_gettop(L_) - arguments;  // of the function
    lua_pushcfunction(L_, describe_error);
    lua_insert(L_, base);
    const bool limited = std::exchange(limited_, true);
    const int status = lua_pcall(L_, arguments, results, base);
    limited_ = limited;
    lua_remove(L_, base);
    if (status == 0) return;

    std::string message, place, trace;
    if (lua_istable(L_, -1)) {
        const int top = lua_gettop(L_);
        message = string_field(L_, top, 1);
        place = string_field(L_, top, 2);
        trace = string_field(L_, top, 3);
    } else if (status == LUA_ERRMEM) {
        message = fmt::format("the script needs more than {} MiB of Lua memory; --script-memory sets the limit",
                              host_.options().script_memory >> 20);
    } else {  // the handler itself failed: no room left to describe the error
        const char* text = lua_tostring(L_, -1);
        message = text ? text : "an error that could not be described";
    }
    lua_pop(L_, 1);
    if (message == "stack overflow") message += ": a function calls itself without end";
    if (message == "not enough memory")
        message = fmt::format("the script needs more than {} MiB of Lua memory; --script-memory sets the limit",
                              host_.options().script_memory >> 20);
    throw with_place(message, place).with_trace(trace);
}

void State::push_entry(const char* name)
{
    lua_rawgeti(L_, LUA_REGISTRYINDEX, entries_);
    lua_getfield(L_, -1, name);
    lua_remove(L_, -2);
}

void State::set_loaded()
{
    push_entry("loaded");
    call(0, 0);
    loaded_ = true;
}

void State::push_kernel(std::size_t kernel) { lua_rawgeti(L_, LUA_REGISTRYINDEX, kernel_references_[kernel]); }

std::size_t State::add_kernel()
{
    kernel_references_.push_back(luaL_ref(L_, LUA_REGISTRYINDEX));
    return kernel_references_.size() - 1;
}

Location State::where() const
{
    lua_Debug info;
    for (int level = 0; lua_getstack(L_, level, &info); ++level) {
        lua_getinfo(L_, "Sl", &info);
        if (info.currentline > 0 && is_graph_code(info)) return {info.source + 1, info.currentline};
        if (runs_body(L_, info) && tail_call.line > 0) break;
    }
    return tail_call;
}

ObjectPtr State::to_object(int index)
{
    if (lua_type(L_, index) != LUA_TUSERDATA || !lua_getmetatable(L_, index)) return nullptr;
    luaL_getmetatable(L_, object_metatable);
    const bool ours = lua_rawequal(L_, -1, -2);
    lua_pop(L_, 2);
    return ours ? *static_cast<ObjectPtr*>(lua_touserdata(L_, index)) : nullptr;
}

void State::push_object(const ObjectPtr& object)
{
    new (lua_newuserdata(L_, sizeof(ObjectPtr))) ObjectPtr(object);
    luaL_getmetatable(L_, object_metatable);
    lua_setmetatable(L_, -2);
}

Value State::to_value(int index)
{
    if (index < 0) index = lua_gettop(L_) + index + 1;
    if (!lua_checkstack(L_, 8)) throw Error("a table is nested too deep");
    switch (lua_type(L_, index)) {
        case LUA_TNIL:
            return {};
        case LUA_TBOOLEAN:
            return Value(lua_toboolean(L_, index) != 0);
        case LUA_TNUMBER:
            return Value(static_cast<double>(lua_tonumber(L_, index)));
        case LUA_TSTRING: {
            std::size_t size = 0;
            const char* text = lua_tolstring(L_, index, &size);
            return Value(std::string(text, size));
        }
        case LUA_TFUNCTION:
            return Value(std::shared_ptr<const FrameFunction>(std::make_shared<ScriptFunction>(*this, index)));
        case LUA_TTABLE: {
            auto table = std::make_shared<Table>();
            const std::size_t length = lua_objlen(L_, index);
            table->list.reserve(length);
            for (std::size_t i = 1; i <= length; ++i) {
                lua_rawgeti(L_, index, static_cast<int>(i));
                table->list.push_back(to_value(-1));
                lua_pop(L_, 1);
            }
            lua_pushnil(L_);
            while (lua_next(L_, index)) {
                if (lua_type(L_, -2) == LUA_TSTRING) {
                    table->named.emplace(lua_tostring(L_, -2), to_value(-1));
                } else if (lua_type(L_, -2) == LUA_TNUMBER) {
                    const double key = lua_tonumber(L_, -2);
                    const auto whole = static_cast<std::int64_t>(key);
                    if (static_cast<double>(whole) != key)
                        throw Error(fmt::format("a table has the key {}; numbered keys are whole", key));
                    if (whole < 1 || whole > static_cast<std::int64_t>(length))
                        table->numbered.emplace(whole, to_value(-1));
                } else {
                    throw Error(fmt::format("a table has a {} as a key; keys are names or whole numbers",
                                            luaL_typename(L_, -2)));
                }
                lua_pop(L_, 1);
            }
            return Value(std::shared_ptr<const Table>(std::move(table)));
        }
        case LUA_TUSERDATA: {
            const ObjectPtr object = to_object(index);
            if (const auto* name = dynamic_cast<const AttributeName*>(object.get()))
                return Value(AttributeRef{name->name});
            if (object) return Value(object);
            break;
        }
        case cdata_type: {
            push_entry("unpack_vec3");
            lua_pushvalue(L_, index);
            call(1, 3);
            const bool is_vec3 = !lua_isnil(L_, -3);
            const Vec3d v(lua_tonumber(L_, -3), lua_tonumber(L_, -2), lua_tonumber(L_, -1));
            lua_pop(L_, 3);
            if (is_vec3) return Value(v);
            break;
        }
        default:
            break;
    }
    throw Error(fmt::format("a {} can't be used as a value here", luaL_typename(L_, index)));
}

void State::push(const Value& value)
{
    if (const auto* boolean = value.get<bool>()) {
        lua_pushboolean(L_, *boolean);
    } else if (const auto* number = value.get<double>()) {
        lua_pushnumber(L_, *number);
    } else if (const auto* text = value.get<std::string>()) {
        lua_pushlstring(L_, text->data(), text->size());
    } else if (const auto* v = value.get<Vec3d>()) {
        push_entry("make_vec3");
        for (int axis = 0; axis < 3; ++axis) lua_pushnumber(L_, (*v)[axis]);
        call(3, 1);
    } else if (const auto ramp = value.object<Ramp>()) {
        push_entry("make_ramp");
        lua_createtable(L_, static_cast<int>(ramp->keys.size()), 0);
        for (std::size_t i = 0; i < ramp->keys.size(); ++i) {
            const auto& [position, of_key] = ramp->keys[i];
            push(Value(std::make_shared<const Table>(Table{{Value(position), of_key}, {}, {}})));
            lua_rawseti(L_, -2, static_cast<int>(i) + 1);
        }
        call(1, 1);
    } else if (const auto* object = value.get<ObjectPtr>()) {
        push_object(*object);
    } else if (const Table* table = value.table()) {
        lua_createtable(L_, static_cast<int>(table->list.size()), static_cast<int>(table->named.size()));
        int place = 0;
        for (const Value& element : table->list) {
            push(element);
            lua_rawseti(L_, -2, ++place);
        }
        for (const auto& [key, element] : table->numbered) {
            push(element);
            lua_rawseti(L_, -2, static_cast<int>(key));
        }
        for (const auto& [key, element] : table->named) {
            lua_pushlstring(L_, key.data(), key.size());
            push(element);
            lua_rawset(L_, -3);
        }
    } else if (const auto* reference = value.get<AttributeRef>()) {
        push_object(std::make_shared<AttributeName>(reference->name));
    } else {
        lua_pushnil(L_);
    }
}

}  // namespace rapid

#include "bindings/host/values.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstddef>
#include <lua.hpp>
#include <utility>

#include "bindings/host/kernel_analysis.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_host.h"
#include "bindings/host/state.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/object.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/shape.h"

struct lua_State;

namespace rapid {

// Accounts for the memory of objects that handles hold: level sets, meshes and points, whose bytes Lua's collector does
// not see. The collector runs when they have doubled, so that a script that makes a new one in each frame retains a
// few, not all. Small objects, graph nodes included, count too: beyond the budget the next one is an error.
void release(lua_State* L, const Object& object);

namespace {

constexpr char counts_field[] = "rapid.handle_memory";  // in the registry

constexpr std::size_t min_held = std::size_t{16} << 20;  // bytes below which a collection is not worthwhile

constexpr std::size_t piece = std::size_t{64} << 20;  // bytes per request

struct Counts {
    std::size_t held = 0, most = min_held;
    std::size_t left = piece;  // bytes left of the last request; the first piece is not requested
};

Counts& counts_of(lua_State* L)
{
    lua_getfield(L, LUA_REGISTRYINDEX, counts_field);
    Counts& counts = *static_cast<Counts*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return counts;
}

// OpenVDB's nodes above the leaves: each of the two upper kinds has a pointer for every possible child, 32^3 and 16^3
// of them, and an object at the origin spans eight nodes of each kind.
constexpr std::size_t bytes_of_upper_nodes = 8 * (32 * 32 * 32 + 16 * 16 * 16) * sizeof(void*);

// Returns the approximate bytes of an object's arrays.
std::size_t weight_of(const Object& object)
{
    constexpr std::size_t bytes_of_node = 1024;  // of a graph node
    if (dynamic_cast<const NodeHandle*>(&object)) return bytes_of_node;
    // A level set is two grids of floats: one for queries, whose blocks are about half full, and OpenVDB's, which some
    // get later but all are charged for.
    constexpr std::size_t bytes_per_voxel = 2 * 2 * sizeof(float);
    constexpr std::size_t bytes_of_leaves = std::size_t{2} << 20;  // for grids that do not report their size
    if (dynamic_cast<const PlacedLevelSet*>(&object)) return 0;    // the level set's owner is charged
    if (const auto* level_set = dynamic_cast<const LevelSet*>(&object))
        return bytes_of_upper_nodes + static_cast<std::size_t>(level_set->active_voxels()) * bytes_per_voxel;
    if (const auto* mesh = dynamic_cast<const Mesh*>(&object))
        return mesh->positions.size() * sizeof(Vec3f) + mesh->triangles.size() * sizeof(Mesh::Triangle);
    if (const auto* points = dynamic_cast<const PointsObject*>(&object)) return points->points.bytes();
    if (dynamic_cast<const VectorGrid*>(&object) || dynamic_cast<const DensityGrid*>(&object))
        return bytes_of_upper_nodes + bytes_of_leaves;
    // A shape offered by an embedding program uses that program's memory, whose size is unknown.
    constexpr std::size_t bytes_of_shape = std::size_t{64} << 10;
    return dynamic_cast<const Shape*>(&object) ? bytes_of_shape : 0;
}

}  // namespace

// Stores the counts of a new state in its registry.
void count_handles(lua_State* L)
{
    new (lua_newuserdata(L, sizeof(Counts))) Counts;
    lua_setfield(L, LUA_REGISTRYINDEX, counts_field);
}

// Counts an object that a handle holds or releases. hold() may run the collector. Throws Error if the memory is
// full.
void hold(lua_State* L, const Object& object)
{
    const std::size_t bytes = weight_of(object);
    if (bytes == 0) return;
    Counts& counts = counts_of(L);
    counts.held += bytes;
    const bool asks = counts.left < bytes, full = asks && !fits_in_memory(piece);
    counts.left = asks ? piece : counts.left - bytes;
    if (!full && counts.held <= counts.most) return;
    lua_gc(L, LUA_GCCOLLECT, 0);
    counts.most = std::max(min_held, 2 * counts.held);
    if (!full) return;
    malloc_trim(0);  // memory released by the collector
    if (!fits_in_memory(piece))
        throw memory_exceeded("a further 64 MiB of nodes, level sets, meshes and points", piece, "make fewer of them");
}

void release(lua_State* L, const Object& object)
{
    if (const std::size_t bytes = weight_of(object)) counts_of(L).held -= bytes;
}

namespace {

constexpr char object_metatable[] = "rapid.object";
constexpr int cdata_type = 10;  // LUA_TCDATA, which lua.h does not define

// Reads the entries of the table at `index` that are not in its list.
void read_entries(State& state, int index, Table& table)
{
    lua_State* L = state.lua();
    const auto length = static_cast<std::int64_t>(table.list.size());
    lua_pushnil(L);
    while (lua_next(L, index)) {
        if (lua_type(L, -2) == LUA_TSTRING) {
            table.named.emplace(lua_tostring(L, -2), to_value(state, -1));
        } else if (lua_type(L, -2) == LUA_TNUMBER) {
            const double key = lua_tonumber(L, -2);
            const auto whole = static_cast<std::int64_t>(key);
            if (static_cast<double>(whole) != key)
                throw Error(fmt::format("a table has the key {}; numeric keys must be whole numbers", key));
            if (whole < 1 || whole > length) table.numbered.emplace(whole, to_value(state, -1));
        } else {
            throw Error(
                fmt::format("a table has a {} as a key; keys must be names or whole numbers", luaL_typename(L, -2)));
        }
        lua_pop(L, 1);
    }
}

Value to_table(State& state, int index)
{
    lua_State* L = state.lua();
    auto table = std::make_shared<Table>();
    // The length of a table of keys, {[2] = a, [14] = b}, may be any index that is followed by nil.
    lua_rawgeti(L, index, 1);
    const std::size_t length = lua_isnil(L, -1) ? 0 : lua_objlen(L, index);
    lua_pop(L, 1);
    table->list.reserve(length);
    for (std::size_t i = 1; i <= length; ++i) {
        lua_rawgeti(L, index, static_cast<int>(i));
        table->list.push_back(to_value(state, -1));
        lua_pop(L, 1);
    }
    read_entries(state, index, *table);
    return Value(std::shared_ptr<const Table>(std::move(table)));
}

// Returns nil for any other cdata.
Value to_vec3(State& state, int index)
{
    lua_State* L = state.lua();
    state.push_entry("unpack_vec3");
    lua_pushvalue(L, index);
    state.call(1, 3);
    const bool is_vec3 = !lua_isnil(L, -3);
    const Vec3d v(lua_tonumber(L, -3), lua_tonumber(L, -2), lua_tonumber(L, -1));
    lua_pop(L, 3);
    return is_vec3 ? Value(v) : Value();
}

// Returns nil for a userdata that is not an object of the runtime.
Value to_object_value(State& state, int index)
{
    const ObjectPtr object = to_object(state, index);
    if (const auto* name = dynamic_cast<const AttributeName*>(object.get())) return Value(AttributeRef{name->name});
    return object ? Value(object) : Value();
}

void push_table(State& state, const Table& table)
{
    lua_State* L = state.lua();
    lua_createtable(L, static_cast<int>(table.list.size()), static_cast<int>(table.named.size()));
    int place = 0;
    for (const Value& element : table.list) {
        push(state, element);
        lua_rawseti(L, -2, ++place);
    }
    for (const auto& [key, element] : table.numbered) {
        push(state, element);
        lua_rawseti(L, -2, static_cast<int>(key));
    }
    for (const auto& [key, element] : table.named) {
        push_text(L, key);
        push(state, element);
        lua_rawset(L, -3);
    }
}

// Pushes the function that lua/ramp.lua makes from the keys.
void push_ramp(State& state, const Ramp& ramp)
{
    lua_State* L = state.lua();
    state.push_entry("make_ramp");
    lua_createtable(L, static_cast<int>(ramp.keys.size()), 0);
    for (std::size_t i = 0; i < ramp.keys.size(); ++i) {
        const auto& [position, of_key] = ramp.keys[i];
        push_table(state, Table{{Value(position), of_key}, {}, {}});
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
    state.call(1, 1);
}

// Returns the error for a Lua value without a runtime form. A frame is recognized by its text.
std::string no_value(lua_State* L, int index)
{
    if (lua_type(L, index) == cdata_type && luaL_callmeta(L, index, "__tostring")) {
        const std::string text = text_at(L, -1);
        lua_pop(L, 1);
        if (text.starts_with("frame "))
            return "the frame can't be used as a value here; it has frame.time, frame.number and frame.dt";
    }
    return fmt::format("a {} can't be used as a value here", luaL_typename(L, index));
}

}  // namespace

Value to_value(State& state, int index)
{
    lua_State* L = state.lua();
    if (index < 0) index = lua_gettop(L) + index + 1;
    if (!lua_checkstack(L, 8)) throw Error("a table is nested too deeply");
    Value value;
    switch (lua_type(L, index)) {
        case LUA_TNIL:
            return {};
        case LUA_TBOOLEAN:
            return Value(lua_toboolean(L, index) != 0);
        case LUA_TNUMBER:
            return Value(static_cast<double>(lua_tonumber(L, index)));
        case LUA_TSTRING:
            return Value(text_at(L, index));
        case LUA_TFUNCTION:
            return Value(script_function(state, index));
        case LUA_TTABLE:
            return to_table(state, index);
        case LUA_TUSERDATA:
            value = to_object_value(state, index);
            break;
        case cdata_type:
            value = to_vec3(state, index);
            break;
        default:
            break;
    }
    if (value.is_nil()) throw Error(no_value(L, index));
    return value;
}

ObjectPtr to_object(State& state, int index)
{
    lua_State* L = state.lua();
    if (lua_type(L, index) != LUA_TUSERDATA || !lua_getmetatable(L, index)) return nullptr;
    luaL_getmetatable(L, object_metatable);
    const bool ours = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    if (!ours) return nullptr;
    const ObjectPtr& object = *static_cast<ObjectPtr*>(lua_touserdata(L, index));
    if (!object) throw Error("the object was already collected as garbage");
    return object;
}

void push(State& state, const Value& value)
{
    lua_State* L = state.lua();
    if (const auto* boolean = value.get<bool>()) {
        lua_pushboolean(L, *boolean);
    } else if (const auto* number = value.get<double>()) {
        lua_pushnumber(L, *number);
    } else if (const auto* text = value.get<std::string>()) {
        push_text(L, *text);
    } else if (const auto* v = value.get<Vec3d>()) {
        state.push_entry("make_vec3");
        for (int axis = 0; axis < 3; ++axis) lua_pushnumber(L, (*v)[axis]);
        state.call(3, 1);
    } else if (const auto ramp = value.object<Ramp>()) {
        push_ramp(state, *ramp);
    } else if (const auto* object = value.get<ObjectPtr>()) {
        push_object(state, *object);
    } else if (const Table* table = value.table()) {
        push_table(state, *table);
    } else if (const auto* reference = value.get<AttributeRef>()) {
        push_object(state, std::make_shared<AttributeName>(reference->name));
    } else {
        lua_pushnil(L);
    }
}

void push(State& state, std::map<std::string, Value> entries) { push_table(state, Table{{}, {}, std::move(entries)}); }

void push_object(State& state, const ObjectPtr& object)
{
    lua_State* L = state.lua();
    if (!object) return lua_pushnil(L);  // of a sequence without an object at this frame
    hold(L, *object);
    new (lua_newuserdata(L, sizeof(ObjectPtr))) ObjectPtr(object);
    luaL_getmetatable(L, object_metatable);
    lua_setmetatable(L, -2);
}

void register_objects(lua_State* L)
{
    count_handles(L);
    luaL_newmetatable(L, object_metatable);
    lua_pushcfunction(L, [](lua_State* of_object) -> int {
        ObjectPtr& object = *static_cast<ObjectPtr*>(lua_touserdata(of_object, 1));
        release(of_object, *object);
        object.reset();  // a resurrected handle holds nothing
        return 0;
    });
    lua_setfield(L, -2, "__gc");
    lua_pushboolean(L, 0);
    lua_setfield(L, -2, "__metatable");
    lua_pop(L, 1);
}

int set_object_methods(State& state)
{
    lua_State* L = state.lua();
    luaL_getmetatable(L, object_metatable);
    lua_pushvalue(L, 1);
    lua_setfield(L, -2, "__index");
    lua_pushvalue(L, 2);
    lua_setfield(L, -2, "__mul");
    lua_pushvalue(L, 3);
    lua_setfield(L, -2, "__call");
    lua_pushcfunction(L, [](lua_State* of_object) {
        return guarded(of_object, [](State& s) {
            push_text(s.lua(), describe(Value(to_object(s, 1))));
            return 1;
        });
    });
    lua_setfield(L, -2, "__tostring");
    return 0;
}

std::shared_ptr<const Ramp> read_ramp(const Param& param, const Value& value)
{
    const auto refuse = [&](const std::string& what) {
        throw Error(
            fmt::format("{} {}; it must be a list of keys with increasing positions and values of one type, such as {{ "
                        "{{0, 1}}, {{0.5, 4}} }} or {{ {{0, {{1, 0, 0}}}} }}",
                        param.name, what));
    };
    const Table* table = value.table();
    if (!table || table->list.empty() || !table->named.empty() || !table->numbered.empty())
        refuse("= " + describe(value));

    auto ramp = std::make_shared<Ramp>();
    for (const Value& key : table->list) {
        const Table* pair = key.table();
        const double* position = pair && pair->list.size() == 2 ? pair->list[0].get<double>() : nullptr;
        if (!position || !std::isfinite(*position)) refuse("has the key " + describe(key));
        if (!ramp->keys.empty() && !(*position > ramp->keys.back().first))
            refuse(fmt::format("has the position {:g} after {:g}", *position, ramp->keys.back().first));
        Value kept;
        if (pair->list[1].get<double>()) {
            double number = 0;
            read_value(param, pair->list[1], number);
            kept = Value(number);
        } else {
            Vec3d vector;
            read_value(param, pair->list[1], vector);
            kept = Value(vector);
        }
        if (!ramp->keys.empty() && ramp->keys.back().second.index() != kept.index())
            refuse("has both numbers and vec3s as values");
        ramp->keys.emplace_back(*position, std::move(kept));
    }
    return ramp;
}

namespace {

class ScriptFunction : public FrameFunction, public Located {
public:
    ScriptFunction(State& state, int index) : state_(state), location_(location_of_function(state.lua(), index))
    {
        if (location_.file.empty()) location_ = {};
        lua_pushvalue(state.lua(), index);
        reference_ = luaL_ref(state.lua(), LUA_REGISTRYINDEX);
    }

    Value call(const Frame& frame) const override
    {
        lua_State* L = state_.lua();
        const Watchdog::Section section(state_.host().watchdog,
                                        fmt::format("{}:{}: a parameter's function", location_.file, location_.line));
        const MakerCache::Call remembered(cache_, state_.host().maker_cache);
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
        Value result = to_value(state_, -1);
        lua_pop(L, 1);
        return result;
    }

    Location location() const override { return location_; }

    void refuse_memory() const
    {
        lua_State* L = state_.lua();
        state_.push_entry("remembers");
        lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
        state_.call(1, 1);
        const StoreOutside found(L);
        lua_pop(L, 1);
        found.refuse();
    }

private:
    State& state_;
    Location location_;
    int reference_ = 0;
    mutable MakerCache cache_;  // used on one thread
};

}  // namespace

std::shared_ptr<const FrameFunction> script_function(State& state, int index)
{
    auto function = std::make_shared<ScriptFunction>(state, index);
    if (ScriptHost& host = state.host(); host.options().keeps_state && state.is_main()) {
        if (state.is_loaded())
            function->refuse_memory();
        else
            host.frame_functions.push_back(function);
    }
    return function;
}

void refuse_memory(const FrameFunction& function)
{
    if (const auto* script = dynamic_cast<const ScriptFunction*>(&function)) script->refuse_memory();
}

}  // namespace rapid

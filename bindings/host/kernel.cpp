#include "bindings/host/kernel.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <lua.hpp>
#include <optional>

#include "bindings/host/detail.h"
#include "bindings/host/script_host.h"
#include "bindings/host/state.h"
#include "runtime/points/members.h"
#include "runtime/points/point_text.h"

extern "C" {
#include "lua/chunk.h"
}

namespace rapid {
namespace {

// By what a number is refused that is none (lua/kernel.lua): what the point has is told then.
constexpr std::string_view not_finite_text = "a float is finite";

// Names on a point that are no attributes.
bool is_method(const std::string& name)
{
    constexpr std::string_view methods[] = {"join", "leave", "within", "kill", "rand", "index"};
    return std::find(std::begin(methods), std::end(methods), name) != std::end(methods);
}

// The keys of the table at the top of the stack, by a field of it.
std::set<std::string> keys_of(lua_State* L, const char* field)
{
    std::set<std::string> keys;
    lua_getfield(L, -1, field);
    lua_pushnil(L);
    while (lua_next(L, -2)) {
        lua_pop(L, 1);
        keys.insert(lua_tostring(L, -1));
    }
    lua_pop(L, 1);
    return keys;
}

bool flag_of(lua_State* L, const char* field)
{
    lua_getfield(L, -1, field);
    const bool set = lua_toboolean(L, -1) != 0;
    lua_pop(L, 1);
    return set;
}

struct ColumnMemory {
    const char* data = nullptr;     // of the set's first point
    std::size_t element_bytes = 0;  // of a point; 0 where all share one value

    void* at(std::size_t point) const { return const_cast<char*>(data) + point * element_bytes; }
};

template <class T>
ColumnMemory memory_of(const Column<T>& column)
{
    const Strided<T> values = column.read();
    return {reinterpret_cast<const char*>(values.data), values.stride * sizeof(T)};
}

}  // namespace

// The columns and groups that a runner is made for, by name and type, and where they lie.
struct Kernel::Layout {
    struct Entry {
        std::string name, type;
        bool writable;
        bool uniform = false;  // all points share one value
    };
    std::vector<Entry> columns, groups;
    bool predicate = false, masked = false, action = false;
    std::string key;  // equal for layouts that one runner serves

    // Once columns stay where they are. mask: it runs on some points of a chunk alone.
    void settle(const PointSet& points, bool mask)
    {
        masked = mask;
        // What is written is writable by now, each point with a value of its own.
        for (Entry& e : columns)
            e.uniform = !e.writable && std::visit([](const auto& c) { return c.is_uniform(); }, *points.find(e.name));
        for (Entry& e : groups) e.uniform = !e.writable && points.find_group(e.name)->is_uniform();
        finish();
    }

    void finish()
    {
        key = fmt::format("{}{}{}", predicate ? 'p' : '-', masked ? 'm' : '-', action ? 'a' : '-');
        const auto marks = [](const Entry& e) { return e.writable ? "!" : e.uniform ? "=" : ""; };
        for (const Entry& e : columns) key += fmt::format(" {}:{}{}", e.name, e.type, marks(e));
        for (const Entry& e : groups) key += fmt::format(" ({}{})", e.name, marks(e));
    }
};

void Kernel::analyse()
{
    State& state = host_.main();
    lua_State* L = state.lua();
    state.push_entry("analyse");
    state.push_kernel(number);
    lua_pushboolean(L, !of_the_set);
    state.call(2, 1);
    reads_ = keys_of(L, "reads");
    writes_ = keys_of(L, "writes");
    may_ = keys_of(L, "may");
    may_write_ = keys_of(L, "may_write");
    joins_ = keys_of(L, "joins");
    asks_ = keys_of(L, "asks");
    asks_any_ = flag_of(L, "asks_any");
    kills_ = flag_of(L, "kills");
    asks_places_ = flag_of(L, "asks_places") || flag_of(L, "computes_names");

    for (const std::string& name : keys_of(L, "calls")) {
        lua_getfield(L, -1, "calls");
        lua_getfield(L, -1, name.c_str());
        const int line = static_cast<int>(lua_tointeger(L, -1));
        lua_pop(L, 3);
        const std::string near = did_you_mean(name, {"join", "leave", "within", "kill", "rand"});
        throw Error(fmt::format("p has no method \"{}\"{}", name,
                                near.empty() ? "; it has join, leave, within, kill and rand" : near))
            .at({location.file, line});
    }

    lua_getfield(L, -1, "writes");
    for (const char* name : {"id", "dt", "index"}) {
        lua_getfield(L, -1, name);
        const int line = static_cast<int>(lua_tointeger(L, -1));
        lua_pop(L, 1);
        if (line == 0) continue;
        lua_pop(L, 2);
        throw Error(fmt::format("the kernel assigns p.{}, which is read only", name)).at({location.file, line});
    }
    lua_pop(L, 1);

    lua_getfield(L, -1, "stores");
    lua_rawgeti(L, -1, 1);
    if (lua_istable(L, -1)) {
        lua_getfield(L, -1, "message");
        lua_getfield(L, -2, "line");
        lua_getfield(L, -3, "source");
        const std::string message = lua_tostring(L, -3), source = lua_tostring(L, -1);
        const int line = static_cast<int>(lua_tonumber(L, -2));
        lua_pop(L, 6);
        throw Error(message).at({source.substr(source.rfind('@', 0) == 0 ? 1 : 0), line});
    }
    lua_pop(L, 2);

    lua_getfield(L, -1, "computed_group");
    if (lua_isnumber(L, -1) && !may_compute_groups) {
        const int line = static_cast<int>(lua_tonumber(L, -1));
        lua_pop(L, 2);
        throw Error("the kernel joins or leaves a group under a computed name; name it as a constant: p:join \"old\"")
            .at({location.file, line});
    }
    lua_pop(L, 2);

    state.push_entry("fingerprint");
    state.push_kernel(number);
    state.call(1, 1);
    fingerprint = lua_tostring(L, -1);
    lua_pop(L, 1);
}

void Kernel::uses(Uses& uses, const KernelArguments& arguments) const
{
    this->uses(uses);
    uses.reads.insert(uses.reads.end(), arguments.reads.begin(), arguments.reads.end());
    uses.writes.insert(uses.writes.end(), arguments.writes.begin(), arguments.writes.end());
    uses.makes_groups.insert(uses.makes_groups.end(), arguments.joins.begin(), arguments.joins.end());
    uses.joins_groups.insert(uses.joins_groups.end(), arguments.joins.begin(), arguments.joins.end());
}

void Kernel::uses_in_action(Uses& uses, const KernelArguments& arguments) const
{
    this->uses(uses, arguments);
    for (auto* names : {&uses.reads, &uses.writes, &uses.may}) std::erase(*names, "force");
}

void Kernel::uses(Uses& uses) const
{
    const auto attributes = [](const std::set<std::string>& names, std::vector<std::string>& into) {
        for (const std::string& name : names)
            if (!is_method(name)) into.push_back(name);
    };
    attributes(reads_, uses.reads);
    attributes(writes_, uses.writes);
    attributes(may_, uses.may);
    uses.makes_groups.insert(uses.makes_groups.end(), joins_.begin(), joins_.end());
    uses.joins_groups.insert(uses.joins_groups.end(), joins_.begin(), joins_.end());
    uses.takes_groups.insert(uses.takes_groups.end(), asks_.begin(), asks_.end());
    // What a function of all points asks for by a method's argument is in no bytecode of its own.
    if (of_the_set || asks_any_) uses.reads_all = true;
}

// The names that it sees, of those that are there now. To be settled.
Kernel::Layout Kernel::layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const
{
    Layout layout;
    layout.predicate = predicate;
    for (const auto& [name, column] : points.columns()) {
        const bool named = writes_.count(name) || may_write_.count(name) || arguments.writes.count(name);
        const bool written = !predicate && named && name != "id" && name != "dt";
        // p:rand needs the id.
        if (!written && !reads_.count(name) && !may_.count(name) && !arguments.reads.count(name) && name != "id")
            continue;
        layout.columns.push_back({name, std::string(type_name(type_of(column))), written});
    }
    for (const auto& [name, members] : points.groups()) {
        const bool written = !predicate && (joins_.count(name) || arguments.joins.count(name));
        if (written || asks_any_ || asks_.count(name)) layout.groups.push_back({name, "", written});
    }
    return layout;
}

// P and v are in double inside Solve, and the force is the sub-step's.
void Kernel::make_layout_of_action(Layout& layout, const KernelArguments& arguments) const
{
    layout.action = true;
    std::erase_if(layout.columns, [](const Layout::Entry& e) { return e.name == "force"; });
    for (Layout::Entry& entry : layout.columns)
        if (entry.name == "P" || entry.name == "v") entry.type = "vec3d", entry.uniform = false;
    const bool pushes = writes_.count("force") || may_write_.count("force") || arguments.writes.count("force");
    if (pushes || reads_.count("force") || may_.count("force") || arguments.reads.count("force"))
        layout.columns.push_back({"force", "vec3d", pushes});
    layout.finish();
}

State::Runner& Kernel::runner_for(State& state, const Layout& layout) const
{
    std::vector<State::Runner>& runners = state.runners[number];
    for (State::Runner& runner : runners)
        if (runner.layout == layout.key) return runner;

    lua_State* L = state.lua();
    state.push_entry("runner");
    state.push_kernel(number);
    lua_newtable(L);
    const auto push_entries = [&](const std::vector<Layout::Entry>& entries, const char* field) {
        lua_createtable(L, static_cast<int>(entries.size()), 0);
        for (std::size_t i = 0; i < entries.size(); ++i) {
            lua_createtable(L, 0, 4);
            lua_pushlstring(L, entries[i].name.data(), entries[i].name.size());
            lua_setfield(L, -2, "name");
            lua_pushlstring(L, entries[i].type.data(), entries[i].type.size());
            lua_setfield(L, -2, "type");
            lua_pushboolean(L, entries[i].uniform);
            lua_setfield(L, -2, "uniform");
            lua_pushboolean(L, entries[i].writable);
            lua_setfield(L, -2, "writable");
            lua_rawseti(L, -2, static_cast<int>(i) + 1);
        }
        lua_setfield(L, -2, field);
    };
    push_entries(layout.columns, "columns");
    push_entries(layout.groups, "groups");
    lua_pushboolean(L, layout.predicate);
    lua_setfield(L, -2, "predicate");
    lua_pushboolean(L, layout.masked);
    lua_setfield(L, -2, "masked");
    lua_pushboolean(L, layout.action);
    lua_setfield(L, -2, "action");

    State::Runner runner{layout.key};
    const std::size_t pointers = layout.columns.size() + layout.groups.size();
    runner.chunk = static_cast<rapid_chunk*>(lua_newuserdata(L, sizeof(rapid_chunk) + pointers * sizeof(void*)));
    *runner.chunk = {};
    runner.chunk->at = -1;
    lua_pushvalue(L, -1);
    luaL_ref(L, LUA_REGISTRYINDEX);  // for as long as the state lives
    state.call(3, 2);
    runner.set_params = luaL_ref(L, LUA_REGISTRYINDEX);
    runner.run = luaL_ref(L, LUA_REGISTRYINDEX);
    return runners.emplace_back(std::move(runner));
}

// What a node's evaluation leaves for a pass that runs after it.
struct Caller {
    explicit Caller(const Evaluation& now)
        : frame(now.frame), node(now.node), location(now.location), random(now.random)
    {
    }

    Frame frame;
    std::string node;
    Location location;
    RandomKey random;

    std::string watched() const { return fmt::format("{}:{}: node \"{}\"", location.file, location.line, node); }
};

struct Kernel::Pass {
    Pass(const PointSet& set, const Caller& who, const Layout& made_for, const std::map<std::string, Value>& third)
        : points(set), caller(who), layout(made_for), values(third)
    {
        static std::atomic<std::uint64_t> last{0};
        serial = ++last;
        for (const Layout::Entry& entry : layout.columns)
            columns.push_back(entry.type == "vec3d"
                                  ? ColumnMemory{nullptr, sizeof(Vec3d)}
                                  : std::visit([](const auto& c) { return memory_of(c); }, *points.find(entry.name)));
        for (const Layout::Entry& entry : layout.groups) groups.push_back(memory_of(*points.find_group(entry.name)));
    }

    const PointSet& points;
    const Caller& caller;
    const Layout& layout;
    const std::map<std::string, Value>& values;  // the third argument
    std::uint64_t serial;                        // of this pass: parameters are handed to each state once a pass
    std::vector<ColumnMemory> columns, groups;
};

// What a runner is given: pointers are to the first point's value in the layout's columns, and then in its groups.
struct Kernel::Call {
    rapid_chunk chunk{};
    std::vector<void*> pointers;
};

// The chunk's place, members and results are set.
void Kernel::run_chunk(const Pass& pass, const rapid_chunk& chunk) const
{
    Call call{chunk, {}};
    call.pointers.reserve(pass.columns.size() + pass.groups.size());
    for (const ColumnMemory& memory : pass.columns)
        call.pointers.push_back(memory.at(static_cast<std::size_t>(chunk.first)));
    run_chunk(pass, call);
}

// So are its columns.
void Kernel::run_chunk(const Pass& pass, Call& call) const
{
    rapid_chunk& chunk = call.chunk;
    const auto begin = static_cast<std::size_t>(chunk.first);
    for (const ColumnMemory& memory : pass.groups) call.pointers.push_back(memory.at(begin));
    chunk.random = pass.caller.random.value;
    chunk.number = static_cast<double>(pass.caller.frame.number);
    chunk.time = pass.caller.frame.time;
    chunk.dt = pass.caller.frame.dt;

    const KernelOrder::Way way = host_.kernel_way(pass.caller.node);
    if (way == KernelOrder::Forward) return call_runner(host_.local(), pass, call);
    const std::int32_t size = chunk.size;
    for (std::int32_t k = 0; k < size; ++k) {
        const std::int32_t i = way == KernelOrder::Reversed ? size - 1 - k : k;
        call_runner(way == KernelOrder::TwoStates && i % 2 == 1 ? host_.second() : host_.local(), pass,
                    one_point(pass, call, i));
    }
}

// The chunk's point i as a chunk of its own.
Kernel::Call Kernel::one_point(const Pass& pass, const Call& call, std::int32_t i)
{
    Call point = call;
    for (std::size_t c = 0; c < point.pointers.size(); ++c) {
        const std::size_t columns = pass.columns.size();
        const ColumnMemory& memory = c < columns ? pass.columns[c] : pass.groups[c - columns];
        point.pointers[c] = static_cast<char*>(point.pointers[c]) + static_cast<std::size_t>(i) * memory.element_bytes;
    }
    const auto at = [i](auto* first) { return first ? first + i : nullptr; };
    rapid_chunk& chunk = point.chunk;
    chunk.size = 1;
    chunk.first += i;
    chunk.kill = at(chunk.kill);
    chunk.result = at(chunk.result);
    chunk.members = at(chunk.members);
    chunk.times = at(chunk.times);
    chunk.steps = at(chunk.steps);
    return point;
}

void Kernel::call_runner(State& state, const Pass& pass, const Call& call) const
{
    lua_State* L = state.lua();
    State::Runner& runner = runner_for(state, pass.layout);
    if (runner.pass != pass.serial && (!pass.values.empty() || may_.count("detail"))) {
        lua_rawgeti(L, LUA_REGISTRYINDEX, runner.set_params);
        Table table, details;
        table.named = pass.values;
        for (const auto& [name, value] : pass.points.details) details.named[name] = value_of(value);
        state.push(Value(std::make_shared<const Table>(std::move(table))));
        state.push(Value(std::make_shared<const Table>(std::move(details))));
        state.call(2, 0);
        runner.pass = pass.serial;
    }

    *runner.chunk = call.chunk;
    runner.chunk->at = -1;
    std::copy(call.pointers.begin(), call.pointers.end(), reinterpret_cast<void**>(runner.chunk + 1));
    lua_rawgeti(L, LUA_REGISTRYINDEX, runner.run);
    try {
        const State::InKernel in_kernel(state);
        state.call(0, 0);
    } catch (Error& error) {
        const int place = std::exchange(runner.chunk->at, -1);
        const auto at_point = [&] { return static_cast<std::size_t>(call.chunk.first + place); };
        const auto id = [&] { return pass.points.id()[at_point()]; };
        const bool not_finite = error.message().find(not_finite_text) != std::string::npos;
        const std::string at =
            place < 0 ? fmt::format("frame {}", pass.caller.frame.number)
                      : fmt::format("point id {}, frame {}{}", id(), pass.caller.frame.number,
                                    not_finite ? "; " + text_of_point(pass.points, at_point()) : std::string());
        const Location where = error.location().file.empty() ? location : error.location();
        Error placed(fmt::format("{} ({})", error.message(), at));
        placed.at(where).in_node(pass.caller.node).with_trace(error.trace());
        throw placed;
    }
}

// Points that go through a kernel together: all of the set where the order is reversed, the last chunk first, too.
std::size_t Kernel::chunk_of(const Caller& caller, std::size_t size) const
{
    return host_.kernel_way(caller.node) == KernelOrder::Reversed ? std::max(size, chunk_size) : chunk_size;
}

class Kernel::KernelTest : public PointTest {
public:
    KernelTest(const Kernel& kernel, const PointSet& points, const Evaluation& now)
        : kernel_(kernel),
          points_(points),
          caller_(now),
          section_(kernel.host_, caller_.watched()),
          layout_(kernel.layout_for(points, arguments_, true))
    {
    }

    void begin(bool of_all) override
    {
        layout_.settle(points_, !of_all);
        pass_.emplace(points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }

    void test(std::size_t begin, std::span<std::uint8_t> selected) const override
    {
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(selected.size());
        chunk.first = static_cast<double>(begin);
        chunk.members = layout_.masked ? selected.data() : nullptr;
        chunk.result = selected.data();
        kernel_.run_chunk(*pass_, chunk);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const Caller caller_;
    const ScriptHost::Section section_;
    const KernelArguments arguments_;
    Layout layout_;
    std::optional<Pass> pass_;
};

std::unique_ptr<PointTest> Kernel::test_of(const PointSet& points, const Evaluation& now) const
{
    return std::make_unique<KernelTest>(*this, points, now);
}

// None where it has no point to visit.
std::optional<Kernel::Layout> Kernel::make_writable(PointSet& points, const std::string& group,
                                                    const KernelArguments& arguments) const
{
    for (const auto* names : {&joins_, &arguments.joins})
        for (const std::string& name : *names) points.group(name);
    const Strided<std::uint8_t> members = members_of(points, group);
    if (points.empty() || (members.stride == 0 && !members[0])) return std::nullopt;
    Layout layout = layout_for(points, arguments, false);
    for (const Layout::Entry& entry : layout.columns)
        if (entry.writable) std::visit([](auto& column) { column.write(); }, *points.find(entry.name));
    for (const Layout::Entry& entry : layout.groups)
        if (entry.writable) points.group(entry.name).write();
    return layout;
}

class Kernel::KernelPass : public EditPass {
public:
    KernelPass(const Kernel& kernel, const PointSet& points, const std::string& group, const Evaluation& told,
               const KernelArguments& arguments, const Before& before, Layout layout)
        : EditPass(told),
          kernel_(kernel),
          points_(points),
          group_(group),
          before_(before),
          caller_(told),
          section_(kernel.host_, caller_.watched()),
          arguments_(arguments),
          layout_(std::move(layout))
    {
    }

    void begin() override
    {
        members_ = members_of(points_, group_);
        layout_.settle(points_, members_.stride != 0 || before_.removals);
        pass_.emplace(points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }
    bool is_script() const override { return true; }

    void visit(const Stretch& stretch) override
    {
        // As it is now: a kernel may leave the very group that chooses its points.
        std::vector<std::uint8_t> chosen;
        if (layout_.masked) chosen = stretch.choose(members_);
        std::vector<std::uint8_t> killed(kernel_.kills_ ? stretch.size() : 0);
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(stretch.size());
        chunk.first = static_cast<double>(stretch.begin);
        chunk.members = chosen.empty() ? nullptr : chosen.data();
        chunk.kill = killed.empty() ? nullptr : killed.data();
        kernel_.run_chunk(*pass_, chunk);
        stretch.remove(killed);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const std::string group_;
    const Before before_;
    const Caller caller_;
    const ScriptHost::Section section_;
    const KernelArguments arguments_;
    Layout layout_;
    Strided<std::uint8_t> members_{nullptr, 0};
    std::optional<Pass> pass_;
};

std::unique_ptr<EditPass> Kernel::prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                          const KernelArguments& arguments, const Before& before) const
{
    std::optional<Layout> layout = make_writable(points, group, arguments);
    if (!layout) return nullptr;
    return std::make_unique<KernelPass>(*this, points, group, now, arguments, before, std::move(*layout));
}

class Kernel::KernelActionPass : public ActionPass {
public:
    KernelActionPass(const Kernel& kernel, PointSet& points, const Caller& caller, Layout layout,
                     const std::map<std::string, Value>& values, std::vector<std::uint8_t> chosen)
        : kernel_(kernel),
          section_(kernel.host_, caller.watched()),
          layout_(std::move(layout)),
          chosen_(std::move(chosen)),
          pass_(points, caller, layout_, values)
    {
    }

    void act(const Chunk& chunk, std::span<Vec3d> force, std::span<std::uint8_t> dead) override
    {
        Call call;
        for (std::size_t i = 0; i < layout_.columns.size(); ++i) {
            const std::string& name = layout_.columns[i].name;
            call.pointers.push_back(layout_.columns[i].type != "vec3d" ? pass_.columns[i].at(chunk.first)
                                    : name == "P"                      ? chunk.P.data()
                                    : name == "v"                      ? chunk.v.data()
                                                                       : force.data());
        }
        call.chunk.size = static_cast<std::int32_t>(chunk.size());
        call.chunk.first = static_cast<double>(chunk.first);
        call.chunk.kill = dead.data();
        if (layout_.masked) call.chunk.members = const_cast<std::uint8_t*>(chosen_.data()) + chunk.first;
        call.chunk.substep = chunk.substep;
        call.chunk.times = chunk.time.data();
        call.chunk.steps = chunk.dt.data();
        kernel_.run_chunk(pass_, call);
    }

private:
    const Kernel& kernel_;
    const ScriptHost::Section section_;
    const Layout layout_;
    const std::vector<std::uint8_t> chosen_;  // of the layout's group, where it is masked
    Pass pass_;
};

class Kernel::KernelAction : public Action {
public:
    KernelAction(const Kernel& kernel, const Evaluation& now, KernelArguments arguments)
        : kernel_(kernel), caller_(now), arguments_(std::move(arguments))
    {
        node = now.node;
        location = now.location;
    }

    void prepare(PointSet& points) const override { kernel_.make_writable(points, group, arguments_); }

    std::unique_ptr<ActionPass> begin(PointSet& points) const override
    {
        const Strided<std::uint8_t> members = members_of(points, group);
        if (points.empty() || (members.stride == 0 && !members[0])) return nullptr;
        Layout layout = kernel_.layout_for(points, arguments_, false);
        layout.settle(points, members.stride != 0);
        kernel_.make_layout_of_action(layout, arguments_);
        // Of its own: a kernel may leave the very group that chooses its points, and acts on them for the whole step.
        std::vector<std::uint8_t> chosen;
        if (layout.masked) chosen.assign(members.data, members.data + points.size());
        return std::make_unique<KernelActionPass>(kernel_, points, caller_, std::move(layout), arguments_.values,
                                                  std::move(chosen));
    }

private:
    const Kernel& kernel_;
    const Caller caller_;
    const KernelArguments arguments_;
};

std::shared_ptr<const Action> Kernel::action(const std::string& group, const Evaluation& now,
                                             const KernelArguments& arguments) const
{
    auto action = std::make_shared<KernelAction>(*this, now, arguments);
    action->group = group;
    return action;
}

}  // namespace rapid

#include "bindings/host/kernel.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>
#include <optional>

#include "bindings/host/chunk.h"
#include "bindings/host/detail.h"
#include "bindings/host/kernel_lanes.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_host.h"
#include "runtime/base/first_error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/graph/registry.h"
#include "runtime/points/members.h"
#include "runtime/points/point_names.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

void Kernel::analyse()
{
    analysis_ = analyse_kernel(host_.main(), source);
    fingerprint = fingerprint_of(host_.main(), source.number);
    if (source.of_the_set) return;
    objects_ = objects_of(host_.main(), source.number);
    for (const ObjectPtr& object : objects_.value_or(std::vector<ObjectPtr>()))
        if (is_moving_shape(*object) || dynamic_cast<const Mesh*>(object.get())) moving_.push_back(object);
}

void Kernel::begin_step(const FrameClock& clock, const Frame& frame) const
{
    step_shapes_.clear();
    for (const ObjectPtr& object : moving_) step_shapes_.emplace_back(object.get(), step_shape(object, clock, frame));
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
    const auto add_attributes = [](const std::set<std::string>& names, std::vector<std::string>& into) {
        for (const std::string& name : names) {
            const PointName* known = find_point_name(name);
            if (!known || known->role == PointName::OwnColumn) into.push_back(name);
        }
    };
    const auto add = [](const std::set<std::string>& names, std::vector<std::string>& into) {
        into.insert(into.end(), names.begin(), names.end());
    };
    add_attributes(analysis_.reads, uses.reads);
    add_attributes(analysis_.writes, uses.writes);
    add_attributes(analysis_.may, uses.may);
    add(analysis_.joins, uses.makes_groups);
    add(analysis_.joins, uses.joins_groups);
    add(analysis_.queries, uses.takes_groups);
    // The bytecode does not show which attributes a function of all points reads by a method's argument.
    if (source.of_the_set || analysis_.queries_any_group) uses.reads_all = true;
}

KernelLayout Kernel::layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const
{
    KernelLayout layout;
    layout.predicate = predicate;
    for (const auto& [name, column] : points.columns()) {
        const bool assigned =
            analysis_.writes.count(name) || analysis_.may_write.count(name) || arguments.writes.count(name);
        const bool written = !predicate && assigned && !is_read_only(name);
        const bool read = analysis_.reads.count(name) || analysis_.may.count(name) || arguments.reads.count(name) ||
                          name == "id";  // p:rand needs it
        if (written || read) layout.columns.push_back({name, std::string(type_name(type_of(column))), written});
    }
    for (const auto& [name, members] : points.groups()) {
        const bool written = !predicate && (analysis_.joins.count(name) || arguments.joins.count(name));
        if (written || analysis_.queries_any_group || analysis_.queries.count(name))
            layout.groups.push_back({name, "", written});
    }
    return layout;
}

std::optional<KernelLayout> Kernel::make_writable(PointSet& points, const std::string& group,
                                                  const KernelArguments& arguments) const
{
    for (const auto* names : {&analysis_.joins, &arguments.joins})
        for (const std::string& name : *names) points.group(name);
    const Strided<std::uint8_t> members = members_of(points, group);
    if (points.empty() || (members.stride == 0 && !members[0])) return std::nullopt;
    KernelLayout layout = layout_for(points, arguments, false);
    layout.make_writable(points);
    return layout;
}

// In reversed order the chunk is the whole set, so that the last point comes first.
std::size_t Kernel::chunk_of(const KernelCaller& caller, std::size_t size) const
{
    return host_.sequence_of(caller.node) == KernelOrder::Reversed ? std::max(size, chunk_size) : chunk_size;
}

namespace {

void set_text(lua_State* L, const char* field, const std::string& text)
{
    push_text(L, text);
    lua_setfield(L, -2, field);
}

void set_flag(lua_State* L, const char* field, bool flag)
{
    lua_pushboolean(L, flag);
    lua_setfield(L, -2, field);
}

void set_entries(lua_State* L, const char* field, const std::vector<KernelLayout::Entry>& entries)
{
    lua_createtable(L, static_cast<int>(entries.size()), 0);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        lua_createtable(L, 0, 4);
        set_text(L, "name", entries[i].name);
        set_text(L, "type", entries[i].type);
        set_flag(L, "uniform", entries[i].uniform);
        set_flag(L, "writable", entries[i].writable);
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
    lua_setfield(L, -2, field);
}

void push_layout(lua_State* L, const KernelLayout& layout)
{
    lua_newtable(L);
    set_entries(L, "columns", layout.columns);
    set_entries(L, "groups", layout.groups);
    set_flag(L, "predicate", layout.predicate);
    set_flag(L, "masked", layout.masked);
    set_flag(L, "action", layout.action);
}

// Pushes a chunk with room for the pointers to its columns and groups. It lives as long as the state.
rapid_chunk* push_chunk(lua_State* L, std::size_t pointers)
{
    auto* chunk = static_cast<rapid_chunk*>(lua_newuserdata(L, sizeof(rapid_chunk) + pointers * sizeof(void*)));
    *chunk = {};
    chunk->at = -1;
    lua_pushvalue(L, -1);
    luaL_ref(L, LUA_REGISTRYINDEX);
    return chunk;
}

}  // namespace

void KernelLayout::make_writable(PointSet& points) const
{
    double bytes = 0;  // bytes of columns that were uniform before
    std::size_t expanded = 0;
    const auto add = [&]<class T>(const Column<T>& column) {
        if (!column.is_uniform()) return;
        bytes += static_cast<double>(points.size()) * sizeof(T);
        ++expanded;
    };
    for (const Entry& entry : columns)
        if (entry.writable) std::visit(add, *points.find(entry.name));
    for (const Entry& entry : groups)
        if (entry.writable) add(points.group(entry.name));
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("{} attributes and groups of {} points", expanded, points.size()), bytes,
                              "write fewer in the kernel");
    for (const Entry& entry : columns)
        if (entry.writable) std::visit([](auto& column) { column.write(); }, *points.find(entry.name));
    for (const Entry& entry : groups)
        if (entry.writable) points.group(entry.name).write();
}

void KernelLayout::settle(const PointSet& points, bool mask)
{
    masked = mask;
    // Every writable column now has a value for each point.
    for (Entry& e : columns)
        e.uniform = !e.writable && std::visit([](const auto& c) { return c.is_uniform(); }, *points.find(e.name));
    for (Entry& e : groups) e.uniform = !e.writable && points.find_group(e.name)->is_uniform();
    make_key();
}

void KernelLayout::settle_action(bool reads_force, bool writes_force)
{
    action = true;
    std::erase_if(columns, [](const Entry& e) { return e.name == "force"; });
    for (Entry& entry : columns)
        if (entry.name == "P" || entry.name == "v") entry.type = "vec3d", entry.uniform = false;
    if (writes_force || reads_force) columns.push_back({"force", "vec3d", writes_force});
    make_key();
}

void KernelLayout::make_key()
{
    key = fmt::format("{}{}{}", predicate ? 'p' : '-', masked ? 'm' : '-', action ? 'a' : '-');
    const auto marks = [](const Entry& e) { return e.writable ? "!" : e.uniform ? "=" : ""; };
    for (const Entry& e : columns) key += fmt::format(" {}:{}{}", e.name, e.type, marks(e));
    for (const Entry& e : groups) key += fmt::format(" ({}{})", e.name, marks(e));
}

State::Runner& runner_for(State& state, std::size_t kernel, const KernelLayout& layout)
{
    std::vector<State::Runner>& runners = state.runners[kernel];
    for (State::Runner& runner : runners)
        if (runner.layout == layout.key) return runner;

    lua_State* L = state.lua();
    state.push_entry("runner");
    state.push_kernel(kernel);
    push_layout(L, layout);
    State::Runner runner;
    runner.layout = layout.key;
    runner.chunk = push_chunk(L, layout.columns.size() + layout.groups.size());
    state.call(3, 3);
    runner.translate = luaL_ref(L, LUA_REGISTRYINDEX);
    runner.set_params = luaL_ref(L, LUA_REGISTRYINDEX);
    runner.run = luaL_ref(L, LUA_REGISTRYINDEX);
    return runners.emplace_back(std::move(runner));
}

// Runs kernels inside Solve: actions, at every substep.
class Kernel::ScriptActionPass : public ActionPass {
public:
    ScriptActionPass(const Kernel& kernel, PointSet& points, const KernelCaller& caller, KernelLayout layout,
                     const std::map<std::string, Value>& values, std::vector<std::uint8_t> chosen)
        : section_(kernel.host_.watchdog, caller.title()),
          layout_(std::move(layout)),
          chosen_(std::move(chosen)),
          pass_(kernel, points, caller, layout_, values)
    {
    }

    void act(const Chunk& chunk, std::span<Vec3d> force, std::span<std::uint8_t> dead) override
    {
        std::vector<void*> columns;
        for (std::size_t i = 0; i < layout_.columns.size(); ++i) {
            const KernelLayout::Entry& entry = layout_.columns[i];
            columns.push_back(entry.type != "vec3d" ? pass_.column(i, chunk.first)
                              : entry.name == "P"   ? chunk.P.data()
                              : entry.name == "v"   ? chunk.v.data()
                                                    : force.data());
        }
        rapid_chunk of_kernel{};
        of_kernel.size = static_cast<std::int32_t>(chunk.size());
        of_kernel.first = static_cast<double>(chunk.first);
        of_kernel.kill = dead.data();
        if (layout_.masked) of_kernel.members = const_cast<std::uint8_t*>(chosen_.data()) + chunk.first;
        of_kernel.substep = chunk.substep;
        of_kernel.times = chunk.time.data();
        of_kernel.steps = chunk.dt.data();
        pass_.run(of_kernel, std::move(columns));
    }

private:
    const Watchdog::Section section_;
    const KernelLayout layout_;
    const std::vector<std::uint8_t> chosen_;  // members of the action's group, if it is masked
    const KernelPass pass_;
};

class Kernel::ScriptAction : public Action {
public:
    ScriptAction(const Kernel& kernel, const Evaluation& now, KernelArguments arguments)
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
        KernelLayout layout = kernel_.layout_for(points, arguments_, false);
        layout.settle(points, members.stride != 0);
        layout.settle_action(reads_force(), writes_force());
        // This is a copy: a kernel may leave the group that chooses its points, but acts on them for the whole step.
        std::vector<std::uint8_t> chosen;
        if (layout.masked) chosen.assign(members.data, members.data + points.size());
        return std::make_unique<ScriptActionPass>(kernel_, points, caller_, std::move(layout), arguments_.values,
                                                  std::move(chosen));
    }

private:
    bool reads_force() const
    {
        const KernelAnalysis& analysis = kernel_.analysis_;
        return analysis.reads.count("force") || analysis.may.count("force") || arguments_.reads.count("force");
    }
    bool writes_force() const
    {
        const KernelAnalysis& analysis = kernel_.analysis_;
        return analysis.writes.count("force") || analysis.may_write.count("force") || arguments_.writes.count("force");
    }

    const Kernel& kernel_;
    const KernelCaller caller_;
    const KernelArguments arguments_;
};

std::shared_ptr<const Action> Kernel::action(const std::string& group, const Evaluation& now,
                                             const KernelArguments& arguments) const
{
    auto action = std::make_shared<ScriptAction>(*this, now, arguments);
    action->group = group;
    return action;
}

// Runs kernels between the nodes of a graph: as tests of points, and as edits.
class Kernel::TestPass : public PointTest {
public:
    TestPass(const Kernel& kernel, const PointSet& points, const Evaluation& now)
        : kernel_(kernel),
          points_(points),
          caller_(now),
          section_(kernel.host_.watchdog, caller_.title()),
          layout_(kernel.layout_for(points, arguments_, true))
    {
    }

    void begin(bool of_all) override
    {
        layout_.settle(points_, !of_all);
        pass_.emplace(kernel_, points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }

    void test(std::size_t begin, std::span<std::uint8_t> selected) const override
    {
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(selected.size());
        chunk.first = static_cast<double>(begin);
        chunk.members = layout_.masked ? selected.data() : nullptr;
        chunk.result = selected.data();
        pass_->run(chunk);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const KernelCaller caller_;
    const Watchdog::Section section_;
    const KernelArguments arguments_;
    KernelLayout layout_;
    std::optional<KernelPass> pass_;
};

std::unique_ptr<PointTest> Kernel::test_of(const PointSet& points, const Evaluation& now) const
{
    return std::make_unique<TestPass>(*this, points, now);
}

void Kernel::edit(PointSet& points, std::size_t first, const Evaluation& now) const
{
    for (const std::string& name : analysis_.joins) points.group(name);
    if (first == points.size()) return;
    const KernelArguments none;
    KernelLayout layout = layout_for(points, none, false);
    layout.make_writable(points);
    layout.settle(points, false);
    const KernelCaller caller(now);
    const Watchdog::Section section(host_.watchdog, caller.title());
    const KernelPass pass(*this, points, caller, layout, none.values);

    const std::size_t size = points.size();
    std::vector<std::uint8_t> killed(kills() ? size : 0);
    FirstError error;
    for_each_chunk(
        size - first,
        [&](std::size_t begin, std::size_t end) {
            rapid_chunk chunk{};
            chunk.size = static_cast<std::int32_t>(end - begin);
            chunk.first = static_cast<double>(first + begin);
            chunk.kill = killed.empty() ? nullptr : killed.data() + first + begin;
            error.guard(0, begin, [&] { pass.run(chunk); });
        },
        chunk_of(caller, size - first));
    error.rethrow();
    if (std::find(killed.begin(), killed.end(), 1) == killed.end()) return;
    for (std::uint8_t& mark : killed) mark = !mark;
    points.keep(killed);
    now.figures.died += size - points.size();
}

class Kernel::Edit : public EditPass {
public:
    Edit(const Kernel& kernel, const PointSet& points, const std::string& group, const Evaluation& evaluation,
         const KernelArguments& arguments, const Before& before, KernelLayout layout)
        : EditPass(evaluation),
          kernel_(kernel),
          points_(points),
          group_(group),
          before_(before),
          caller_(evaluation),
          section_(kernel.host_.watchdog, caller_.title()),
          arguments_(arguments),
          layout_(std::move(layout))
    {
    }

    void begin() override
    {
        members_ = members_of(points_, group_);
        layout_.settle(points_, members_.stride != 0 || before_.removals);
        pass_.emplace(kernel_, points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }
    bool is_script() const override { return true; }

    void visit(const Stretch& stretch) override
    {
        // This is a copy: a kernel may leave the group that chooses its points.
        std::vector<std::uint8_t> chosen;
        if (layout_.masked) chosen = stretch.choose(members_);
        std::vector<std::uint8_t> killed(kernel_.kills() ? stretch.size() : 0);
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(stretch.size());
        chunk.first = static_cast<double>(stretch.begin);
        chunk.members = chosen.empty() ? nullptr : chosen.data();
        chunk.kill = killed.empty() ? nullptr : killed.data();
        pass_->run(chunk);
        stretch.remove(killed);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const std::string group_;
    const Before before_;
    const KernelCaller caller_;
    const Watchdog::Section section_;
    const KernelArguments arguments_;
    KernelLayout layout_;
    Strided<std::uint8_t> members_{nullptr, 0};
    std::optional<KernelPass> pass_;
};

std::unique_ptr<EditPass> Kernel::prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                          const KernelArguments& arguments, const Before& before) const
{
    std::optional<KernelLayout> layout = make_writable(points, group, arguments);
    if (!layout) return nullptr;
    return std::make_unique<Edit>(*this, points, group, now, arguments, before, std::move(*layout));
}

// Nodes whose kernel is written in the scene: `:points`, `:action` and `:detail`.

namespace {

constexpr std::string_view reads_doc = "attributes that the kernel reads by computed names";
constexpr std::string_view writes_doc = "attributes that the kernel assigns by computed names";

// Returns the declared names, which a kernel computes and its bytecode does not show.
KernelArguments declared(const std::vector<std::string>& reads, const std::vector<std::string>& writes)
{
    KernelArguments arguments;
    arguments.reads.insert(reads.begin(), reads.end());
    arguments.writes.insert(writes.begin(), writes.end());
    return arguments;
}

void check_writable(const std::vector<std::string>& writes)
{
    for (const PointName& known : point_names)
        if (known.read_only && std::find(writes.begin(), writes.end(), known.name) != writes.end())
            throw Error(fmt::format("writes: {} is read-only", known.name));
}

// points: edits the points one by one with a Lua function.
struct Points {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<Points>("points", "Runs a Lua function on each point, in parallel.")
            .param(&Points::kernel, "kernel", Value(), any_number(), "", "function of a point, function(p, frame)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&Points::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&Points::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Points>>(); }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses(uses, declared(reads, writes)); }
    bool removes_points() const { return kernel->kills(); }
    bool reads_indices() const { return kernel->reads_indices(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        return kernel->prepare(points, group, now, declared(reads, writes), before);
    }
};
RAPID_NODE(Points);

// action: does the same inside Solve, at every substep (paper §2.3).
struct ScriptAction {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<ScriptAction>("action", "Runs a Lua function on each point inside Solve, in every substep.")
            .param(&ScriptAction::kernel, "kernel", Value(), any_number(), "", "function of a point, function(p, step)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&ScriptAction::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&ScriptAction::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses_in_action(uses, declared(reads, writes)); }
    std::shared_ptr<const Action> dynamic(const Evaluation& now) const
    {
        return kernel->action(group, now, declared(reads, writes));
    }
};
RAPID_NODE(ScriptAction);

// detail: runs a function over the whole set once a frame.
struct Detail {
    std::shared_ptr<const Kernel> kernel;

    static NodeType declare()
    {
        return node<Detail>("detail", "Runs a Lua function over the whole set of points, once per frame.")
            .param(&Detail::kernel, "kernel", Value(), any_number(), "", "function of the set, function(points, frame)")
            .of_type(std::string(Kernel::set_function_type))
            .required()
            .constant()
            .varies();
    }
    void uses(Uses& uses) const { kernel->uses(uses); }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        run_detail(*kernel, inputs[0], now, {});
        return std::move(inputs[0]);
    }
};
RAPID_NODE(Detail);

}  // namespace

}  // namespace rapid

#include "bindings/host/kernel_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <lua.hpp>
#include <utility>

#include "bindings/host/detail.h"
#include "bindings/host/kernel.h"
#include "bindings/host/kernel_functions.h"
#include "bindings/host/kernel_lanes.h"
#include "bindings/host/script_host.h"
#include "bindings/host/values.h"
#include "runtime/points/point_text.h"

namespace rapid {
namespace {

template <class T>
ColumnMemory memory_of(const Column<T>& column)
{
    const Strided<T> values = column.read();
    return {reinterpret_cast<const char*>(values.data), values.stride * sizeof(T)};
}

thread_local const Kernel::StepShapes* shapes_of_pass = nullptr;

}  // namespace

const Shape* KernelPass::shape_now(const Object* object)
{
    if (shapes_of_pass)
        for (const auto& [moving, shape] : *shapes_of_pass)
            if (moving == object) return shape.get();
    return nullptr;
}

std::string KernelCaller::title() const
{
    return fmt::format("{}:{}: node \"{}\"", location.file, location.line, node);
}

KernelPass::KernelPass(const Kernel& kernel, const PointSet& points, const KernelCaller& caller,
                       const KernelLayout& layout, const std::map<std::string, Value>& params)
    : kernel_(kernel), points_(points), caller_(caller), layout_(layout), params_(params), shapes_(kernel.step_shapes())
{
    static std::atomic<std::uint64_t> last{0};
    serial_ = ++last;
    for (const KernelLayout::Entry& entry : layout.columns)
        columns_.push_back(entry.type == "vec3d"
                               ? ColumnMemory{nullptr, sizeof(Vec3d)}  // Solve's own memory
                               : std::visit([](const auto& c) { return memory_of(c); }, *points.find(entry.name)));
    for (const KernelLayout::Entry& entry : layout.groups) groups_.push_back(memory_of(*points.find_group(entry.name)));
}

void KernelPass::run(const rapid_chunk& chunk) const
{
    std::vector<void*> columns;
    columns.reserve(columns_.size() + groups_.size());
    for (const ColumnMemory& memory : columns_) columns.push_back(memory.at(static_cast<std::size_t>(chunk.first)));
    run(chunk, std::move(columns));
}

void KernelPass::run(const rapid_chunk& chunk, std::vector<void*> columns) const
{
    Call call{chunk, std::move(columns)};
    for (const ColumnMemory& memory : groups_)
        call.pointers.push_back(memory.at(static_cast<std::size_t>(chunk.first)));
    call.chunk.random = caller_.random.value;
    call.chunk.number = static_cast<double>(caller_.frame.number);
    call.chunk.time = caller_.frame.time;
    call.chunk.dt = caller_.frame.dt;

    ScriptHost& host = kernel_.host();
    const KernelOrder::Sequence sequence = host.sequence_of(caller_.node);
    if (sequence == KernelOrder::Forward)
        return host.options().on_trace_abort ? call_runner(host.local(), call) : call_lanes(host.local(), call);
    const std::int32_t size = chunk.size;
    for (std::int32_t k = 0; k < size; ++k) {
        const std::int32_t i = sequence == KernelOrder::Reversed ? size - 1 - k : k;
        call_runner(sequence == KernelOrder::TwoStates && i % 2 == 1 ? host.second() : host.local(),
                    part_of(call, i, 1));
    }
}

std::size_t KernelPass::bytes_between(std::size_t pointer) const
{
    return pointer < columns_.size() ? columns_[pointer].element_bytes
                                     : groups_[pointer - columns_.size()].element_bytes;
}

KernelPass::Call KernelPass::part_of(const Call& call, std::int32_t begin, std::int32_t size) const
{
    Call part = call;
    for (std::size_t c = 0; c < part.pointers.size(); ++c)
        part.pointers[c] = static_cast<char*>(part.pointers[c]) + static_cast<std::size_t>(begin) * bytes_between(c);
    const auto at = [begin](auto* first) { return first ? first + begin : nullptr; };
    rapid_chunk& chunk = part.chunk;
    chunk.size = size;
    chunk.first += begin;
    chunk.kill = at(chunk.kill);
    chunk.result = at(chunk.result);
    chunk.members = at(chunk.members);
    chunk.times = at(chunk.times);
    chunk.steps = at(chunk.steps);
    return part;
}

void KernelPass::call_lanes(State& state, const Call& call) const
{
    if (points_.size() < KernelLanes::min_points) return call_runner(state, call);
    State::Runner& runner = runner_for(state, kernel_.source.number, layout_);
    set_params(state, runner);
    if (!runner.lanes) {
        lua_rawgeti(state.lua(), LUA_REGISTRYINDEX, runner.translate);
        runner.lanes = std::make_unique<KernelLanes>(state, layout_, kernel_.source.location);
    }
    if (!runner.lanes->is_ready(state, call.chunk, serial_)) return call_runner(state, call);
    std::vector<LaneChunk::Memory> memory;
    for (std::size_t c = 0; c < call.pointers.size(); ++c) memory.push_back({call.pointers[c], bytes_between(c)});
    runner.lanes->run(call.chunk, memory, [&](std::int32_t begin, std::int32_t end) {
        call_runner(state, part_of(call, begin, end - begin));
    });
}

void KernelPass::call_runner(State& state, const Call& call) const
{
    State::Runner& runner = runner_for(state, kernel_.source.number, layout_);
    set_params(state, runner);
    if (!shapes_.empty()) {
        state.push_entry("forget_moving_shapes");
        state.call(0, 0);
    }
    *runner.chunk = call.chunk;
    runner.chunk->at = runner.chunk->not_finite = -1;
    std::copy(call.pointers.begin(), call.pointers.end(), reinterpret_cast<void**>(runner.chunk + 1));
    lua_rawgeti(state.lua(), LUA_REGISTRYINDEX, runner.run);
    try {
        const State::InKernel in_kernel(state);
        struct Shapes {
            const Kernel::StepShapes* before;
            ~Shapes() { shapes_of_pass = before; }
        } const restored{std::exchange(shapes_of_pass, &shapes_)};
        const KernelMoment moment(runner.chunk->times, &runner.chunk->at);
        state.call(0, 0);
    } catch (const Error& error) {
        const rapid_chunk after = *runner.chunk;
        runner.chunk->at = -1;
        throw placed(error, call.chunk, after);
    }
}

void KernelPass::set_params(State& state, State::Runner& runner) const
{
    if (runner.pass == serial_ || (params_.empty() && !kernel_.may_read("detail"))) return;
    lua_rawgeti(state.lua(), LUA_REGISTRYINDEX, runner.set_params);
    push(state, params_);
    push(state, values_of(points_.details));
    state.call(2, 0);
    runner.pass = serial_;
}

// Returns the error with the point at which the chunk stopped, and that point's values if one became infinite.
Error KernelPass::placed(const Error& error, const rapid_chunk& chunk, const rapid_chunk& after) const
{
    std::string at = fmt::format("frame {}", caller_.frame.number);
    if (after.at >= 0) {
        const auto point = static_cast<std::size_t>(chunk.first + after.at);
        at = fmt::format("point id {}, {}", points_.id()[point], at);
        if (after.not_finite == after.at) at += "; " + text_of_point(points_, point);
    }
    return error.reworded(fmt::format("{} ({})", error.message(), at))
        .at(kernel_.source.location)
        .in_node(caller_.node);
}

}  // namespace rapid

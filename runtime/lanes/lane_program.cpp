#include "runtime/lanes/lane_program.h"

#include <algorithm>
#include <cstring>

#include "runtime/lanes/lane_tile.h"

namespace rapid {
namespace {

bool execute(std::span<const LaneInstruction> code, LaneTile& tile)
{
    return std::all_of(code.begin(), code.end(), [&](const LaneInstruction& now) { return now.operation(tile, now); });
}

}  // namespace

void LaneRunner::begin(const LaneProgram& program, const LaneChunk& chunk)
{
    if (slots_.size() < program.slots) slots_.resize(program.slots);
    std::size_t next = LaneProgram::first_of_chunk;
    const auto fill = [&](double value) {
        double* const into = slots_[next++].numbers();
        std::fill(into, into + tile, value);
    };
    for (const double value : {chunk.number, chunk.time, chunk.dt, chunk.substep}) fill(value);
    for (const double value : program.constants) fill(value);
    for (const double value : chunk.inputs) fill(value);
    LaneTile none(slots_.data(), program, chunk, 0, 0);
    execute(program.shared, none);
    steady_size_ = 0;
}

// Runs the steady instructions, unless the previous tile had the same values.
void LaneRunner::keep_steady(LaneTile& now)
{
    const LaneProgram& program = now.program;
    if (program.steady.empty()) return;
    const float* const values = static_cast<const float*>(now.chunk.columns[program.steady_column].data) + now.first;
    const std::size_t bytes = now.size * sizeof(float);
    if (now.size <= steady_size_ && std::memcmp(steady_.data(), values, bytes) == 0) return;
    execute(program.steady, now);
    std::memcpy(steady_.data(), values, bytes);
    steady_size_ = now.size;
}

bool LaneRunner::run_tile(const LaneProgram& program, const LaneChunk& chunk, std::size_t first, std::size_t size)
{
    double* const visited = slots_[LaneProgram::visited].numbers();
    const auto choose = [&](const auto& is_visited) {
        for (std::size_t i = 0; i < tile; ++i) visited[i] = std::bit_cast<double>(-std::int64_t{is_visited(i)});
    };
    if (!chunk.members) {
        choose([&](std::size_t i) { return i < size; });
    } else {
        const std::span members(chunk.members + first, size);
        if (std::all_of(members.begin(), members.end(), [](std::uint8_t member) { return member == 0; })) return true;
        choose([&](std::size_t i) { return i < size && members[i] != 0; });
    }
    LaneTile now(slots_.data(), program, chunk, first, size);
    keep_steady(now);
    return execute(program.code, now);
}

}  // namespace rapid

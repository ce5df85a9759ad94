// A kernel as a program of lanes (runtime/lanes/lane_program.h), if lua/lanes.lua can translate it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bindings/host/chunk.h"
#include "bindings/host/kernel.h"
#include "bindings/host/state.h"
#include "runtime/base/error.h"
#include "runtime/lanes/lane_program.h"

namespace rapid {

class KernelLanes {
public:
    // Smaller sets are not worth a program.
    static constexpr std::size_t min_points = 32;

    // Takes the translating function off the top of the stack.
    KernelLanes(State& state, const KernelLayout& layout, const Location& location);

    // Returns true if the program can process the chunk. It cannot if the kernel has no program, if a shared value has
    // changed its kind, or if too many tiles have failed. Shared values are read once per pass; `pass` is its number.
    bool is_ready(State& state, const rapid_chunk& chunk, std::uint64_t pass);
    // Processes the chunk. memory: the columns and groups, at the chunk's first point. Calls failed(begin, end) for the
    // points of tiles that the kernel itself must process.
    void run(const rapid_chunk& chunk, std::span<const LaneChunk::Memory> memory,
             const std::function<void(std::int32_t begin, std::int32_t end)>& failed);

private:
    void find_inputs(State& state);

    std::optional<LaneProgram> program_;
    int inputs_now_ = 0;  // a function in the registry
    bool kills_ = false;
    std::size_t columns_, id_;
    std::uint64_t pass_ = 0;   // the pass of the cached inputs
    bool has_inputs_ = false;  // their kinds match the program
    std::vector<double> inputs_;
    LaneRunner runner_;
    std::size_t tiles_ = 0, failed_tiles_ = 0;
};

}  // namespace rapid

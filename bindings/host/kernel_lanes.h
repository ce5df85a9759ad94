// A kernel as a program of lanes (runtime/lanes/lane_program.h), where lua/lanes.lua makes one of it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bindings/host/chunk.h"
#include "bindings/host/kernel_layout.h"
#include "bindings/host/state.h"
#include "runtime/base/error.h"
#include "runtime/lanes/lane_program.h"

namespace rapid {

class KernelLanes {
public:
    // Of fewer points a set is not worth it.
    static constexpr std::size_t least_points = 32;

    // Of the function at the top of the stack, which makes the program; it is taken off.
    KernelLanes(State& state, const KernelLayout& layout, const Location& location);

    // Whether it can go over the chunk. Of a kernel that is none it can't; nor where what all points share has changed
    // its kind, or too many tiles have failed. What they share is asked for once in a pass, of which this is the
    // number.
    bool is_ready(State& state, const rapid_chunk& chunk, std::uint64_t pass);
    // memory: of the columns and groups, at the chunk's first point. Calls failed(begin, end) for the points of tiles
    // that the kernel itself must go over.
    void run(const rapid_chunk& chunk, std::span<const LaneChunk::Memory> memory,
             const std::function<void(std::int32_t begin, std::int32_t end)>& failed);

private:
    void find_inputs(State& state);

    std::optional<LaneProgram> program_;
    int inputs_now_ = 0;  // a function in the registry
    bool kills_ = false;
    std::size_t columns_, id_;
    std::uint64_t pass_ = 0;   // whose inputs it has
    bool has_inputs_ = false;  // they are of the kinds that the program takes
    std::vector<double> inputs_;
    LaneRunner runner_;
    std::size_t tiles_ = 0, failed_tiles_ = 0;
};

}  // namespace rapid

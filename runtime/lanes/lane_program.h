// Straight-line programs over many points. Each instruction processes a tile of points, eight at a time, before the
// next one starts. Branches become masks: both sides are computed and the mask selects.
//
// A number is a double. A flag occupies the bits of a double, all set or all clear. Arithmetic follows IEEE lane by
// lane, so results are bit-identical to those of the same operations for one point at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/math/random.h"
#include "runtime/math/simd.h"

namespace rapid {

class LaneTile;
struct LaneInstruction;

// Processes a tile. Returns false on failure; the caller then has to process the points of the tile itself.
using LaneOperation = bool (*)(LaneTile& tile, const LaneInstruction& now);

// Returns the operation of this name, or null. lane_operations.cpp describes them.
LaneOperation lane_operation(std::string_view name);

struct LaneInstruction {
    LaneOperation operation = nullptr;
    std::uint16_t to = 0, a = 0, b = 0, c = 0;  // slots
    std::uint16_t number = 0;                   // index of a column, a group or a function
};

struct LaneProgram {
    using Function1 = double (*)(double);
    using Function2 = double (*)(double, double);

    // Layout of the first slots: flags of the points to visit, then numbers that all points share, which are those of
    // the chunk (frame, time, dt, substep), the constants, and the inputs.
    static constexpr std::uint16_t visited = 0, first_of_chunk = 1, first_constant = 5;

    std::vector<double> constants;
    std::size_t inputs = 0;
    std::vector<LaneInstruction> shared;  // compute values that all points share: run once per chunk
    std::vector<LaneInstruction> steady;  // depend on a mostly constant float column: run for tiles with new values
    std::uint16_t steady_column = 0;
    std::vector<LaneInstruction> code;  // run for each tile; the stores come last
    std::size_t slots = first_constant;
    std::vector<Function1> functions1;
    std::vector<Function2> functions2;
};

// The points that a program processes.
struct LaneChunk {
    // Address of the first point's value in a column or group. stride: bytes between points, 0 if all share one value.
    struct Memory {
        void* data;
        std::size_t stride;
    };

    std::size_t size = 0;
    double first = 0;                                  // index of the first point in the set
    double number = 0, time = 0, dt = 0, substep = 0;  // of the frame or the step
    std::span<const Memory> columns, groups;
    Memory ids{nullptr, 0};  // int64
    RandomKey random;
    std::uint8_t* kill = nullptr;
    std::uint8_t* result = nullptr;
    const std::uint8_t* members = nullptr;  // the points to visit; null for all
    const double* times = nullptr;          // for actions
    const double* steps = nullptr;
    std::span<const double> inputs;
};

// Runs programs in its own memory.
class LaneRunner {
public:
    static constexpr std::size_t tile = 128;  // points

    // Calls failed(begin, end) for each tile in which an instruction fails. Nothing is stored for such a tile.
    template <class Failed>
    void run(const LaneProgram& program, const LaneChunk& chunk, const Failed& failed)
    {
        begin(program, chunk);
        for (std::size_t first = 0; first < chunk.size; first += tile) {
            const std::size_t end = first + tile < chunk.size ? first + tile : chunk.size;
            if (!run_tile(program, chunk, first, end - first)) failed(first, end);
        }
    }

    static constexpr std::size_t packs = tile / lanes;
    struct alignas(sizeof(Doubles)) Slot {
        Doubles pack[packs];

        double* numbers() { return reinterpret_cast<double*>(pack); }
    };

private:
    void begin(const LaneProgram& program, const LaneChunk& chunk);
    bool run_tile(const LaneProgram& program, const LaneChunk& chunk, std::size_t first, std::size_t size);
    void keep_steady(LaneTile& now);

    std::vector<Slot> slots_;
    std::array<float, tile> steady_;  // values of the steady column for which the slots are valid
    std::size_t steady_size_ = 0;
};

}  // namespace rapid

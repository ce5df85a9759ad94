// Straight-line programs over many points: each instruction goes over a tile of points, eight at a time, before the
// next one does. Branches are masks: what both sides make is computed, and the mask chooses.
//
// A number is a double, and a flag all bits of a double's place or none. Arithmetic is IEEE's, lane by lane, so the
// results are those of the same operations for one point at a time, to the bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/random.h"
#include "runtime/simd.h"

namespace rapid {

class LaneTile;
struct LaneInstruction;

// Of a tile. False: it fails, and what the points of the tile do is up to the caller.
using LaneOperation = bool (*)(LaneTile& tile, const LaneInstruction& now);

// The operation of a name in lane_operations.cpp, where they are described; null where there is none.
LaneOperation lane_operation(std::string_view name);

struct LaneInstruction {
    LaneOperation operation = nullptr;
    std::uint16_t to = 0, a = 0, b = 0, c = 0;  // slots
    std::uint16_t number = 0;                   // of a column, a group or a function
};

struct LaneProgram {
    using Function1 = double (*)(double);
    using Function2 = double (*)(double, double);

    // What lies in the first slots: flags, the points to visit; then numbers that all points share, those of the chunk
    // (frame, time, dt, substep), the constants, and the inputs.
    static constexpr std::uint16_t visited = 0, first_of_chunk = 1, first_constant = 5;

    std::vector<double> constants;
    std::size_t inputs = 0;
    std::vector<LaneInstruction> shared;  // of what all points share: once for a chunk
    std::vector<LaneInstruction> steady;  // of a float column that mostly has one value: for tiles of other values
    std::uint16_t steady_column = 0;
    std::vector<LaneInstruction> code;  // for each tile; the stores are its end
    std::size_t slots = first_constant;
    std::vector<Function1> functions1;
    std::vector<Function2> functions2;
};

// The points that a program goes over.
struct LaneChunk {
    // Of the first point's value in a column or a group; stride: bytes from point to point, 0 where all share one.
    struct Memory {
        void* data;
        std::size_t stride;
    };

    std::size_t size = 0;
    double first = 0;                                  // place in the set of the first one
    double number = 0, time = 0, dt = 0, substep = 0;  // of the frame, or the step
    std::span<const Memory> columns, groups;
    Memory ids{nullptr, 0};  // int64
    RandomKey random;
    std::uint8_t* kill = nullptr;
    std::uint8_t* result = nullptr;
    const std::uint8_t* members = nullptr;  // the points to visit; null for all
    const double* times = nullptr;          // of an action
    const double* steps = nullptr;
    std::span<const double> inputs;
};

// Runs programs, in memory of its own.
class LaneRunner {
public:
    static constexpr std::size_t tile = 128;  // points

    // Calls failed(begin, end) for tiles in which an instruction fails: of these nothing has been stored.
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
    std::array<float, tile> steady_;  // the values of which the slots hold what is steady
    std::size_t steady_size_ = 0;
};

}  // namespace rapid

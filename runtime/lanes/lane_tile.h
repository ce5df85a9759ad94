// The data of an operation: the slots, and the chunk's points in the tile.
#pragma once

#include <bit>
#include <cstdint>
#include <type_traits>

#include "runtime/lanes/lane_program.h"

namespace rapid {

class LaneTile {
public:
    static constexpr std::size_t points = LaneRunner::tile, packs = LaneRunner::packs;

    LaneTile(LaneRunner::Slot* of_slots, const LaneProgram& of_program, const LaneChunk& of_chunk, std::size_t begin,
             std::size_t of_size)
        : program(of_program), chunk(of_chunk), first(begin), size(of_size), slots_(of_slots)
    {
    }

    const LaneProgram& program;
    const LaneChunk& chunk;
    const std::size_t first, size;  // points of the tile in the chunk; lanes after the last point hold arbitrary values

    Doubles* slot(std::uint16_t index) const { return slots_[index].pack; }
    double* numbers(std::uint16_t index) const { return slots_[index].numbers(); }

    // Sets slot `to` to value(k), pack by pack.
    template <class Value>
    void fill(std::uint16_t to, const Value& value) const
    {
        Doubles* const into = slot(to);
        for (std::size_t k = 0; k < packs; ++k) into[k] = value(k);
    }

    // Returns true if any flag is set.
    template <class IsSet>
    bool any_of(const IsSet& is_set) const
    {
        Flags all{};
        for (std::size_t k = 0; k < packs; ++k) all |= is_set(k);
        return any(all);
    }

    bool visits_all() const { return size == points && !chunk.members; }
    bool visits(std::size_t i) const { return is_set(LaneProgram::visited, i); }
    bool is_set(std::uint16_t index, std::size_t i) const
    {
        return std::bit_cast<std::uint64_t>(numbers(index)[i]) != 0;
    }

private:
    LaneRunner::Slot* const slots_;
};

[[gnu::always_inline]] inline Flags as_flags(const Doubles& x) { return std::bit_cast<Flags>(x); }
[[gnu::always_inline]] inline Doubles as_doubles(const Flags& x) { return std::bit_cast<Doubles>(x); }

}  // namespace rapid

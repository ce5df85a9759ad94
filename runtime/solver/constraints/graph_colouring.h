// Rows that share no point, to be projected at the same time.
//
// Gauss-Seidel in colours: within one the order of rows does not matter, so that the result is the same bits on any
// number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rapid {

struct Colours {
    std::vector<std::uint32_t> order;  // of the rows: colour by colour
    std::vector<std::uint32_t> begin;  // of each colour in `order`, and the end of the last
    std::size_t in_turn = 0;           // rows at the end of `order` that were left over: one after the other

    // Each row takes the first colour that none of its points has, in the order of the rows. points: `arity` a row.
    Colours(std::span<const std::uint32_t> points, std::size_t arity, std::size_t size);
    Colours() = default;
};

}  // namespace rapid

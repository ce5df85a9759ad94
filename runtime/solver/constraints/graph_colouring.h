// Graph colouring: rows of one colour share no point.
//
// Within a colour the order of Gauss-Seidel does not matter, so that its rows may be projected at the same time, to the
// same bits on any number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rapid {

struct GraphColouring {
    std::vector<std::uint32_t> order;  // of the rows: colour by colour
    std::vector<std::uint32_t> begin;  // of each colour in `order`, and the end of the last
    std::size_t uncoloured = 0;        // rows at the end of `order`, to be projected one after the other

    // Greedy: each row takes the first colour that none of its points has, in the order of the rows. points: `arity` a
    // row.
    GraphColouring(std::span<const std::uint32_t> points, std::size_t arity, std::size_t size);
    GraphColouring() = default;
};

}  // namespace rapid

// Graph colouring: rows of the same colour share no point.
//
// Gauss-Seidel does not depend on the order within a colour. The rows of a colour can therefore be projected in
// parallel, bit-identically for any number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rapid {

struct GraphColouring {
    std::vector<std::uint32_t> order;  // row indices, colour by colour
    std::vector<std::uint32_t> begin;  // index in `order` of each colour's first row, then the end of the last
    std::size_t uncoloured = 0;        // rows at the end of `order`, to be projected sequentially

    // Colours greedily: each row, in order, takes the first colour that none of its points has. points: `arity` per
    // row.
    GraphColouring(std::span<const std::uint32_t> points, std::size_t arity, std::size_t size);
    GraphColouring() = default;
};

}  // namespace rapid

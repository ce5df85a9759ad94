// Places that points take one by one, each the nearest that fewest have. All are taken once before one is taken twice.
//
// A k-d tree over an array: the middle of a range is a node, what is before and behind it its two branches, which know
// how many of their places are free.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/vec.h"

namespace rapid {

class FreePlaces {
public:
    // Finite ones, at least one. takers: how many have each already.
    FreePlaces(std::vector<Vec3d> places, std::vector<std::uint32_t> takers);

    // The number of the place nearest to P, which it takes; of two as near the first. Of a P that is not finite any.
    std::uint32_t take(const Vec3d& P);

private:
    struct Nearest {
        double distance2;
        std::size_t node;
    };
    void build(std::size_t begin, std::size_t end);
    std::size_t count_free(std::size_t begin, std::size_t end);
    void search(std::size_t begin, std::size_t end, const Vec3d& P, Nearest& nearest) const;

    std::vector<Vec3d> places_;
    std::vector<std::uint32_t> takers_;
    std::uint32_t round_ = 0;           // the fewest takers of a place
    std::vector<std::uint32_t> order_;  // of the tree
    std::vector<std::uint8_t> axis_;    // along which a node parts its range
    std::vector<std::uint32_t> free_;   // places in a node's range with the fewest takers
};

}  // namespace rapid

// Positions that points take one by one, each the nearest of those with the fewest takers. All are taken once before
// any is taken twice.
//
// A k-d tree stored in an array: the middle of a range is a node, the elements before and after it are its two
// branches. Each node stores how many positions in its range are free.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"

namespace rapid {

class FreePositions {
public:
    // positions: finite, at least one. occupancy: current number of takers of each.
    FreePositions(std::vector<Vec3d> positions, std::vector<std::uint32_t> occupancy);

    // Returns the index of the free position nearest to P, and takes it; ties go to the first. Any is taken if P is
    // not finite.
    std::uint32_t take(const Vec3d& P);

private:
    struct Nearest {
        double distance2;
        std::size_t node;
    };
    void build(std::size_t begin, std::size_t end);
    std::size_t count_free(std::size_t begin, std::size_t end);
    void search(std::size_t begin, std::size_t end, const Vec3d& P, Nearest& nearest) const;

    std::vector<Vec3d> positions_;
    std::vector<std::uint32_t> occupancy_;
    std::uint32_t round_ = 0;           // the lowest number of takers
    std::vector<std::uint32_t> order_;  // indices of positions, in tree order
    std::vector<std::uint8_t> axis_;    // along which a node splits its range
    std::vector<std::uint32_t> free_;   // number of positions in a node's range with the fewest takers
};

}  // namespace rapid

// Pairs of points that a neighbour list no longer covers, because one of them has strayed.
//
// Strays are few: each block of the list searches for those near the box of its other points, and strays are compared
// with each other along x.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

class StrayPairs {
public:
    // Finds the unlisted pairs with a stray that are closer than near_contact times the sum of their radii, ascending.
    // Points of radius 0 take no part.
    const std::vector<ContactPair>& find(const Substep& step, std::span<const float> radius, const NeighbourList& list);

private:
    struct Stray {
        Vec3d P;
        std::uint32_t i;
    };
    void sort_strays(const Substep& step, std::span<const float> radius, const NeighbourList& list);
    void find_in_block(std::size_t block, const Substep& step, std::span<const float> radius, const NeighbourList& list,
                       std::vector<ContactPair>& found) const;
    void find_among_strays(std::span<const float> radius);

    std::vector<Stray> strays_;                    // sorted by x
    double largest_ = 0;                           // m, radius of a stray
    std::vector<std::vector<ContactPair>> found_;  // by task
    std::vector<ContactPair> pairs_;
};

}  // namespace rapid

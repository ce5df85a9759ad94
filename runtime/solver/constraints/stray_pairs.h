// The pairs of points that a neighbour list does not hold any more, as one of them has strayed.
//
// Strays are few: each block of the list looks for those that are near the box of its other points, and strays look for
// each other along x.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

class StrayPairs {
public:
    // Finds the pairs that are nearer than near_contact times the sum of their radii, one of them a stray, and are not
    // listed: ascending. Points of radius 0 take no part.
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

    std::vector<Stray> strays_;                    // by x
    double largest_ = 0;                           // m, radius of a stray
    std::vector<std::vector<ContactPair>> found_;  // by tasks
    std::vector<ContactPair> pairs_;
};

}  // namespace rapid

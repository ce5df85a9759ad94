// Union-find over points; the lowest index of a set is its root.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace rapid {

class DisjointSets {
public:
    explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0u); }

    std::uint32_t root(std::uint32_t i)
    {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    // Joins two sets. Returns false if the points are already in one set.
    bool join(std::uint32_t i, std::uint32_t j)
    {
        i = root(i), j = root(j);
        if (i == j) return false;
        parent_[std::max(i, j)] = std::min(i, j);
        return true;
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace rapid

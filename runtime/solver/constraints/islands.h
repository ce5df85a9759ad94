// Islands: points that fall asleep and wake together, because rows carry forces between them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/constraints/disjoint_sets.h"

namespace rapid {

class Islands {
public:
    // weight: inverse masses. A point of infinite mass separates the points linked to it, like a wall.
    explicit Islands(std::span<const double> weight) : weight_(weight) {}

    // Links points that a row acts between.
    void link(std::span<const std::uint32_t> points);
    // Makes a point kinematic: it belongs to an island, but no row moves it.
    void make_kinematic(std::uint32_t i);
    // Numbers the islands in the order of their first points.
    void close();

    std::size_t size() const { return begin_.size() - 1; }
    std::span<const std::uint32_t> operator[](std::size_t island) const  // ascending
    {
        return std::span(points_).subspan(begin_[island], begin_[island + 1] - begin_[island]);
    }
    bool has(std::size_t i) const { return !linked_.empty() && linked_[i]; }
    bool is_kinematic(std::size_t i) const { return !kinematic_.empty() && kinematic_[i]; }

private:
    std::span<const double> weight_;
    std::optional<DisjointSets> sets_;              // set after points are linked
    std::vector<std::uint8_t> linked_, kinematic_;  // empty if no point is
    std::vector<std::uint32_t> begin_{0}, points_;
};

}  // namespace rapid

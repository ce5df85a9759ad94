// Finds the points of a block that may come near each obstacle on their free paths, using bounding boxes.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/motion/free_paths.h"

namespace rapid {

class BroadPhase {
public:
    explicit BroadPhase(const CollisionBlock& block) : block_(block) {}

    // Starts a new block.
    void begin()
    {
        near_.resize(block_.obstacles.size());
        largest_radius_.clear();
        for (const Obstacle& obstacle : block_.obstacles)
            largest_radius_.push_back(obstacle.largest_radius(block_.indices));
    }

    // Skips obstacles that do not look for contacts on paths.
    void find(const FreePaths& paths)
    {
        obstacles_near_.assign(block_.size(), 0);
        for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
            near_[o].clear();
            if (!block_.obstacles[o].is_continuous()) continue;
            paths.find_near(block_.obstacles[o].bounds, largest_radius_[o], near_[o]);
            for (const std::uint32_t i : near_[o]) ++obstacles_near_[i];
        }
    }

    const std::vector<std::uint32_t>& points_near(std::size_t obstacle) const { return near_[obstacle]; }
    int obstacles_near(std::size_t i) const { return obstacles_near_[i]; }
    // The largest radius of the block's points at this obstacle, m.
    double largest_radius(std::size_t obstacle) const { return largest_radius_[obstacle]; }

private:
    const CollisionBlock& block_;
    std::vector<double> largest_radius_;            // by obstacle
    std::vector<std::vector<std::uint32_t>> near_;  // by obstacle
    std::vector<int> obstacles_near_;               // by point
};

}  // namespace rapid

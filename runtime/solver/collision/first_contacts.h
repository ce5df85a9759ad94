// The first contact of each point's path with any of the obstacles: each obstacle is queried for many paths at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"

namespace rapid {

class FirstContacts {
public:
    explicit FirstContacts(const CollisionBlock& block) : block_(block) {}

    // Starts a new block.
    void begin()
    {
        obstacle_.resize(block_.size());
        contact_.resize(block_.size());
    }

    // Drops the contacts of one point, or of all.
    void clear(std::size_t i) { obstacle_[i] = -1; }
    void clear()
    {
        std::fill(obstacle_.begin(), obstacle_.end(), -1);
        found_.clear();
    }

    // Adds a path to the query of the next obstacle, up to the earliest known contact on it.
    void add(std::uint32_t i, const Path& path)
    {
        queried_.push_back(i);
        paths_.push_back(path);
        if (has(i)) paths_.back().duration = contact_[i].time;
    }
    void query(std::size_t obstacle);

    bool has(std::size_t i) const { return obstacle_[i] >= 0; }
    int obstacle(std::size_t i) const { return obstacle_[i]; }
    // Returns the contact; of equally early ones, the one with the first obstacle in the chain.
    const Contact& contact(std::size_t i) const { return contact_[i]; }
    // The points with a contact since clear().
    const std::vector<std::uint32_t>& found() const { return found_; }

private:
    const CollisionBlock& block_;
    std::vector<int> obstacle_;     // by point; -1 for none
    std::vector<Contact> contact_;  // by point
    std::vector<std::uint32_t> found_;

    std::vector<std::uint32_t> queried_;
    std::vector<Path> paths_;
    std::vector<Contact> answers_;
};

}  // namespace rapid

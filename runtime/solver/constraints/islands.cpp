#include "runtime/solver/constraints/islands.h"

namespace rapid {

void Islands::link(std::span<const std::uint32_t> points)
{
    if (!sets_) sets_.emplace(weight_.size()), linked_.resize(weight_.size());
    const std::uint32_t* first = nullptr;
    for (const std::uint32_t& i : points) {
        if (!(weight_[i] > 0)) continue;
        linked_[i] = 1;
        if (!first) first = &i;
        sets_->join(*first, i);
    }
}

void Islands::make_kinematic(std::uint32_t i)
{
    if (!(weight_[i] > 0)) return;
    link({&i, 1});
    kinematic_.resize(weight_.size());
    kinematic_[i] = 1;
}

void Islands::close()
{
    if (!sets_) return;
    std::vector<std::uint32_t> island(linked_.size()), count;
    for (std::uint32_t i = 0; i < linked_.size(); ++i) {
        if (!linked_[i]) continue;
        const std::uint32_t root = sets_->root(i);  // lowest index of its island
        if (root == i) island[i] = static_cast<std::uint32_t>(count.size()), count.push_back(0);
        island[i] = island[root];
        ++count[island[i]];
    }
    begin_.assign(1, 0);
    for (const std::uint32_t size : count) begin_.push_back(begin_.back() + size);
    points_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < linked_.size(); ++i)
        if (linked_[i]) points_[next[island[i]]++] = i;
}

}  // namespace rapid

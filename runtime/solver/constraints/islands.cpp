#include "runtime/solver/constraints/islands.h"

#include <algorithm>

namespace rapid {

std::uint32_t Islands::root_of(std::uint32_t i)
{
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
}

void Islands::bind(std::span<const std::uint32_t> points)
{
    if (root_.empty()) root_.assign(weight_.size(), none);
    std::uint32_t first = none;
    for (const std::uint32_t i : points) {
        if (!(weight_[i] > 0)) continue;
        if (root_[i] == none) root_[i] = i;
        const std::uint32_t root = root_of(i);
        if (first == none) first = root;
        root_[std::max(first, root)] = std::min(first, root);
        first = std::min(first, root);
    }
}

void Islands::hold(std::uint32_t i)
{
    if (!(weight_[i] > 0)) return;
    bind({&i, 1});
    held_.resize(weight_.size());
    held_[i] = 1;
}

void Islands::close()
{
    if (root_.empty()) return;
    std::vector<std::uint32_t> island(root_.size(), none), count;
    for (std::uint32_t i = 0; i < root_.size(); ++i) {
        if (root_[i] == none) continue;
        const std::uint32_t root = root_of(i);  // comes before all others of its island
        if (root == i) island[i] = static_cast<std::uint32_t>(count.size()), count.push_back(0);
        island[i] = island[root];
        ++count[island[i]];
    }
    begin_.assign(1, 0);
    for (const std::uint32_t size : count) begin_.push_back(begin_.back() + size);
    points_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < root_.size(); ++i)
        if (island[i] != none) points_[next[island[i]]++] = i;
}

}  // namespace rapid

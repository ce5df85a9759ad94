#include "runtime/operators/goal/free_positions.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/base/error.h"

namespace rapid {

FreePositions::FreePositions(std::vector<Vec3d> positions, std::vector<std::uint32_t> occupancy)
    : positions_(std::move(positions)),
      occupancy_(std::move(occupancy)),
      order_(positions_.size()),
      axis_(positions_.size()),
      free_(positions_.size())
{
    RAPID_ASSERT(!positions_.empty() && positions_.size() == occupancy_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    build(0, order_.size());
    round_ = *std::min_element(occupancy_.begin(), occupancy_.end());
    count_free(0, order_.size());
}

void FreePositions::build(std::size_t begin, std::size_t end)
{
    if (begin == end) return;
    Eigen::AlignedBox3d box;
    for (std::size_t k = begin; k < end; ++k) box.extend(positions_[order_[k]]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = begin + (end - begin) / 2;
    const auto key = [&](std::uint32_t index) { return std::pair(positions_[index][axis], index); };
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    axis_[middle] = static_cast<std::uint8_t>(axis);
    build(begin, middle);
    build(middle + 1, end);
}

std::size_t FreePositions::count_free(std::size_t begin, std::size_t end)
{
    if (begin == end) return 0;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::size_t count =
        count_free(begin, middle) + count_free(middle + 1, end) + (occupancy_[order_[middle]] == round_);
    free_[middle] = static_cast<std::uint32_t>(count);
    return count;
}

void FreePositions::search(std::size_t begin, std::size_t end, const Vec3d& P, Nearest& nearest) const
{
    if (begin == end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    if (free_[middle] == 0) return;
    const Vec3d& position = positions_[order_[middle]];
    if (occupancy_[order_[middle]] == round_) {
        const double d2 = (position - P).squaredNorm();
        if (d2 < nearest.distance2 || (d2 == nearest.distance2 && order_[middle] < order_[nearest.node]))
            nearest = {d2, middle};
    }
    const double off = P[axis_[middle]] - position[axis_[middle]];
    const auto before = [&] { search(begin, middle, P, nearest); };
    const auto after = [&] { search(middle + 1, end, P, nearest); };
    off > 0 ? after() : before();
    if (off * off <= nearest.distance2) off > 0 ? before() : after();
}

std::uint32_t FreePositions::take(const Vec3d& P)
{
    if (free_[order_.size() / 2] == 0) {
        ++round_;
        count_free(0, order_.size());
    }
    Nearest nearest{std::numeric_limits<double>::infinity(), 0};
    search(0, order_.size(), P.allFinite() ? P : Vec3d(Vec3d::Zero()), nearest);
    ++occupancy_[order_[nearest.node]];
    // One less in each range that contains it.
    for (std::size_t begin = 0, end = order_.size();;) {
        const std::size_t middle = begin + (end - begin) / 2;
        --free_[middle];
        if (middle == nearest.node) return order_[middle];
        (nearest.node < middle ? end : begin) = nearest.node < middle ? middle : middle + 1;
    }
}

}  // namespace rapid

#include "runtime/solver/step_log.h"

#include <algorithm>
#include <tuple>

namespace rapid {

void StepLog::take_dead(const PointSet& points, std::span<const std::uint8_t> dead)
{
    std::vector<std::uint32_t> indices;
    for (std::size_t i = 0; i < dead.size(); ++i)
        if (dead[i]) indices.push_back(static_cast<std::uint32_t>(i)), dead_times_.push_back(died_at_[i]);
    dead_ = points.select(indices);
}

std::vector<LoggedHit> StepLog::hits() const
{
    std::vector<LoggedHit> all;
    for (const std::vector<LoggedHit>& part : hits_) all.insert(all.end(), part.begin(), part.end());
    // The entries of a point from one thread are in order, but the order of threads is not known.
    std::stable_sort(all.begin(), all.end(), [](const LoggedHit& a, const LoggedHit& b) {
        return std::tie(a.point, a.time, a.collider) < std::tie(b.point, b.time, b.collider);
    });
    return all;
}

}  // namespace rapid

#include "runtime/solver/constraints/shape_clearance.h"

#include <algorithm>
#include <limits>

namespace rapid {
namespace {

// How far a point may be pushed within a substep and still be kept out of a shape that it was not near: this fraction
// of its radius plus its own motion. A point pushed farther is found inside in the next substep.
constexpr double push = 0.5;

}  // namespace

double ShapeQuery::reach(const Obstacle& obstacle, std::size_t i) const
{
    return push * obstacle.radius[i] + moved[i - begin];
}

ShapeClearance::ShapeClearance(std::span<const Obstacle> obstacles, std::size_t size)
    : obstacles_(obstacles),
      size_(size),
      any_moves_(std::any_of(obstacles.begin(), obstacles.end(), [](const Obstacle& o) { return o.moves; })),
      clearance_(obstacles.size() * size, -1.0f),
      room_(size, -1.0f)
{
}

void ShapeClearance::begin(std::span<const Vec3d> free)
{
    if (asked_at_.empty()) asked_at_.assign(free.begin(), free.end());
}

// Branchless, because most points are known to be far from all shapes, or close to one for a long time.
void ShapeClearance::open(ShapeQuery& query, const Substep& step, std::size_t end)
{
    const std::span<const Vec3d> free = query.free;
    std::vector<std::uint32_t>& open = query.open;
    open.resize(end - query.begin + 1);
    std::size_t count = 0;
    for (std::size_t i = query.begin; i < end; ++i) {
        // An upper bound of (|moved| + |moved since the last query|)².
        const double moved2 = 2 * ((free[i] - step.start[i]).squaredNorm() + (free[i] - asked_at_[i]).squaredNorm());
        open[count] = static_cast<std::uint32_t>(i);
        count += any_moves_ | !(room_[i] > 0 && double(room_[i]) * double(room_[i]) > moved2);
    }
    open.resize(count);
    query.moved.resize(end - query.begin);
    query.since_asked.resize(end - query.begin);
    for (const std::uint32_t i : open) {
        query.moved[i - query.begin] = (free[i] - step.start[i]).norm();
        query.since_asked[i - query.begin] = (free[i] - asked_at_[i]).norm();
        room_[i] = std::numeric_limits<float>::infinity();
    }
}

void ShapeClearance::ask(ShapeQuery& query, std::size_t obstacle, const Substep& step)
{
    list(query, obstacle, step);
    query.phi.resize(query.P.size());
    query.gradient.resize(query.P.size());
    query.time.assign(query.P.size(), query.since);
    if (query.asked.empty()) return;
    obstacles_[obstacle].shape->distance_at(query.P, query.time, query.phi, query.gradient);
    // Subtracts the point's displacement from asked_at_, because the distance was measured at its current position.
    for (std::size_t k = 0; k < query.asked.size(); ++k) {
        const std::uint32_t i = query.asked[k];
        const double gap = query.phi[k] - obstacles_[obstacle].radius[i];
        clearance_[obstacle * size_ + i] = static_cast<float>(gap - query.since_asked[i - query.begin]);
    }
}

// Lists the points that no bound keeps away from the shape.
void ShapeClearance::list(ShapeQuery& query, std::size_t o, const Substep& step)
{
    const Obstacle& obstacle = obstacles_[o];
    float* clearance = clearance_.data() + o * size_;
    std::vector<std::uint32_t>& asked = query.asked;
    asked.resize(query.open.size() + 1);
    std::size_t near = 0;
    for (const std::uint32_t i : query.open) {
        asked[near] = i;
        near += obstacle.moves | (clearance[i] < query.since_asked[i - query.begin] + query.reach(obstacle, i));
    }
    asked.resize(near);
    query.P.clear();
    std::erase_if(asked, [&](std::uint32_t i) {
        if (!(step.points[i].w > 0) || !obstacle.members[i] || !step.lives(i)) return true;
        const Vec3d& P = query.free[i];
        const double off =
            (P - obstacle.bounds.max()).cwiseMax(obstacle.bounds.min() - P).maxCoeff() - obstacle.radius[i];
        if (off > query.reach(obstacle, i)) {
            clearance[i] = static_cast<float>(off - query.since_asked[i - query.begin]);
            return true;
        }
        query.P.push_back(P);
        return false;
    });
}

void ShapeClearance::close(const ShapeQuery& query, std::size_t o)
{
    const Obstacle& obstacle = obstacles_[o];
    const float* clearance = clearance_.data() + o * size_;
    for (const std::uint32_t i : query.open)
        if (obstacle.members[i])
            room_[i] = std::min(room_[i], clearance[i] - static_cast<float>(push) * obstacle.radius[i]);
}

}  // namespace rapid

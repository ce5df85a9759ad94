#include "runtime/solver/collision/penetration_correction.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace rapid {
namespace {

// Returns a position outside a shape, at most a little farther away than the nearest in any of 26 directions; P if
// there is none.
Vec3d free_position(const Obstacle& obstacle, const Vec3d& P, double radius)
{
    const double size = obstacle.bounds.sizes().maxCoeff() + 2 * radius;
    if (!std::isfinite(size)) return P;
    std::array<Vec3d, 26> candidates;
    std::array<double, 26> phi;
    for (double reach = std::max(obstacle.feature, 0x1p-10 * size); reach < 2 * size; reach *= 1.25) {
        for (int k = 0, direction = 0; k < 27; ++k) {
            const Vec3d d(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
            if (!d.isZero()) candidates[direction++] = P + reach * d.normalized();
        }
        obstacle.shape->distance(candidates, phi, {});
        const auto highest = std::max_element(phi.begin(), phi.end());
        if (*highest >= radius) return candidates[highest - phi.begin()];
    }
    return P;
}

void sort_unique(std::vector<std::uint32_t>& points)
{
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
}

}  // namespace

void PenetrationCorrection::run(std::span<Vec3d> P, const std::vector<std::uint32_t>& lost)
{
    const bool any_moves = std::any_of(block_.obstacles.begin(), block_.obstacles.end(),
                                       [](const Obstacle& obstacle) { return obstacle.moves; });
    inside_ = any_moves ? touched_.list() : lost;
    if (!any_moves) sort_unique(inside_);
    displacements_.clear();
    for (int tries = 0; !inside_.empty() && tries < max_ejections; ++tries) {
        still_inside_.clear();
        for (const Obstacle& obstacle : block_.obstacles)
            if (obstacle.is_continuous()) move_out(obstacle, P, tries >= max_ejections / 2);
        sort_unique(still_inside_);
        inside_.swap(still_inside_);
    }
    audit_.add_trapped(inside_.size());
}

// Moves the points of inside_ that are in this obstacle out of it.
void PenetrationCorrection::move_out(const Obstacle& obstacle, std::span<Vec3d> P, bool to_free_position)
{
    query_.clear();
    for (const std::uint32_t i : inside_)
        if (block_.has_member(obstacle, i) && !obstacle.is_clear_of(P[i], block_.radius(obstacle, i)))
            query_.add(i, P[i]);
    if (query_.empty()) return;
    query_.find_gradients(*obstacle.shape);
    for (std::size_t j = 0; j < query_.size(); ++j) {
        const std::uint32_t i = query_.point[j];
        const double radius = block_.radius(obstacle, i);
        const double f = query_.phi[j] - radius, slope2 = query_.gradient[j].squaredNorm();
        if (f >= -obstacle.contact_tolerance(P[i], radius)) continue;
        const Vec3d before = P[i];
        if (slope2 > 0 && !to_free_position)
            P[i] -= f / slope2 * query_.gradient[j];
        else
            P[i] = free_position(obstacle, P[i], radius);
        displacements_.push_back({i, P[i] - before});
        still_inside_.push_back(i);
    }
}

double PenetrationCorrection::deepest(std::span<const Vec3f> P)
{
    double depth = 0;
    for (const std::uint32_t i : touched_.list())
        if (const int plane = touched_.only_plane(i); plane >= 0)
            depth = std::max(depth, -block_.height_over_plane(i, block_.obstacles[plane], P[i].cast<double>()));
    for (const Obstacle& obstacle : block_.obstacles) {
        query_.clear();
        for (const std::uint32_t i : touched_.list()) {
            if (touched_.only_plane(i) >= 0 || !block_.has_member(obstacle, i)) continue;
            const Vec3d at = P[i].cast<double>();
            if (!obstacle.is_clear_of(at, block_.radius(obstacle, i))) query_.add(i, at);
        }
        if (query_.empty()) continue;
        query_.find_distances(*obstacle.shape);
        for (std::size_t j = 0; j < query_.size(); ++j)
            depth = std::max(depth, block_.radius(obstacle, query_.point[j]) - query_.phi[j]);
    }
    return depth;
}

}  // namespace rapid

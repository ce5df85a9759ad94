#include "runtime/solver/collision/position_rounding.h"

#include <cmath>
#include <limits>

namespace rapid {
namespace {

// Moves the coordinate with the largest normal component by the least amount that lifts the point by `height`.
Vec3f lifted(Vec3f P, const Vec3d& n, double height)
{
    int k;
    n.cwiseAbs().maxCoeff(&k);
    const double target = P[k] + height / n[k];
    const float outward = std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(n[k]));
    P[k] = static_cast<float>(target);
    if (n[k] > 0 ? P[k] < target : P[k] > target) P[k] = std::nextafter(P[k], outward);
    return P;
}

}  // namespace

void PositionRounding::find_moved(std::span<const Vec3d> P, std::span<const Vec3f> initial)
{
    for (auto& side : moved_on_)
        for (std::vector<std::uint32_t>& moved : side) moved.clear();
    moved_on_plane_.clear();
    for (const std::uint32_t i : touched_.list()) {
        initial_P_[i] = initial[i];
        const TouchedPoints::Surfaces& on = touched_.surfaces(i);
        const int first = on[0].obstacle, plane = touched_.only_plane(i);
        if (first < 0 || (P[i] == initial[i].cast<double>() && !block_.obstacles[first].moves)) continue;
        if (plane >= 0) {
            if (plane == first) moved_on_plane_.push_back(i);
            continue;
        }
        for (int side = 0; side < 2 && on[side].obstacle >= 0; ++side) moved_on_[side][on[side].obstacle].push_back(i);
    }
}

// Calls use(i, surface, f, tolerance) for points that have moved on a surface, with f = distance - radius at
// position(i). The two surfaces of an edge are processed one after the other.
template <class Position, class Use>
void PositionRounding::query_surfaces(const Position& position, const Use& use)
{
    for (int side = 0; side < 2; ++side) {
        for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
            const Obstacle& obstacle = block_.obstacles[o];
            if (moved_on_[side][o].empty()) continue;
            query_.clear();
            for (const std::uint32_t i : moved_on_[side][o]) query_.add(i, position(i));
            query_.find_distances(*obstacle.shape);
            for (std::size_t j = 0; j < query_.size(); ++j) {
                const std::uint32_t i = query_.point[j];
                const double f = query_.phi[j] - block_.radius(obstacle, i);
                use(i, touched_.surfaces(i)[side], f, tolerance(i, query_.P[j], obstacle));
            }
        }
    }
}

// Returns the contact tolerance for the largest coordinates of the path, because those of its end may be 0.
double PositionRounding::tolerance(std::size_t i, const Vec3d& P, const Obstacle& obstacle) const
{
    const Vec3d largest = P.cwiseAbs().cwiseMax(initial_P_[i].cast<double>().cwiseAbs());
    return obstacle.contact_tolerance(largest, block_.radius(obstacle, i));
}

void PositionRounding::snap(std::span<Vec3d> P, std::span<const Vec3f> initial)
{
    find_moved(P, initial);
    query_surfaces([&](std::size_t i) { return P[i]; },
                   [&](std::size_t i, const TouchedPoints::Surface& surface, double f, double tolerance) {
                       // The path of a point on a moving shape ignores the turning and acceleration of the shape within
                       // a step.
                       const Obstacle& obstacle = block_.obstacles[surface.obstacle];
                       const double h = block_.context.h;
                       const auto speed = [&](double time) { return obstacle.shape->velocity_at(P[i], time).norm(); };
                       const double carried = obstacle.moves ? h * (speed(0) + speed(h)) : 0;
                       if (std::abs(f) <= tolerance + carried) P[i] -= f * surface.n;
                   });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = block_.obstacles[touched_.only_plane(i)];
        const double f = block_.height_over_plane(i, obstacle, P[i]);
        if (std::abs(f) <= tolerance(i, P[i], obstacle)) P[i] -= f * obstacle.plane->n;
    }
}

void PositionRounding::lift(std::span<Vec3f> rounded)
{
    query_surfaces([&](std::size_t i) { return Vec3d(rounded[i].cast<double>()); },
                   [&](std::size_t i, const TouchedPoints::Surface& surface, double f, double tolerance) {
                       if (f < 0 && f >= -tolerance) rounded[i] = lifted(rounded[i], surface.n, -f);
                   });
    for (const std::uint32_t i : moved_on_plane_) {
        const Obstacle& obstacle = block_.obstacles[touched_.only_plane(i)];
        const Vec3d P = rounded[i].cast<double>();
        const double f = block_.height_over_plane(i, obstacle, P);
        if (f < 0 && f >= -tolerance(i, P, obstacle)) rounded[i] = lifted(rounded[i], obstacle.plane->n, -f);
    }
}

}  // namespace rapid

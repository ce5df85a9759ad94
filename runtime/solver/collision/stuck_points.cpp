#include "runtime/solver/collision/stuck_points.h"

#include <cmath>

namespace rapid {
namespace {

// A stuck point has the surface's velocity to single precision: relative, and absolute in m/s.
constexpr double velocity_tolerance = 1e-6;

}  // namespace

void StuckPoints::begin()
{
    stuck_.assign(block_.size(), 0);
    list_.clear();
}

void StuckPoints::advance()
{
    for (const std::uint32_t i : list_) stuck_[i] = 0;
    list_.clear();
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o) {
        const Obstacle& obstacle = block_.obstacles[o];
        if (obstacle.response != Response::Stick) continue;
        ask_about(obstacle);
        if (query_.empty()) continue;
        query_.find_distances_at_times(*obstacle.shape);
        for (std::size_t j = 0; j < query_.size(); ++j) {
            const std::size_t i = query_.point[j];
            const double radius = block_.radius(obstacle, i);
            if (std::abs(query_.phi[j] - radius) > obstacle.contact_tolerance(block_.P[i], radius)) continue;
            carry(i, static_cast<int>(o), query_.time[j]);
        }
    }
}

// The points that have the velocity of the surface.
void StuckPoints::ask_about(const Obstacle& obstacle)
{
    query_.clear();
    for (std::size_t i = 0; i < block_.size(); ++i) {
        if (!block_.has_member(obstacle, i) || stuck_[i]) continue;
        const double now = block_.frame_time(i, block_.dt[i]);
        const Vec3d vc = obstacle.shape->velocity_at(block_.P[i], now);
        if ((block_.v[i] - vc).norm() <= velocity_tolerance * (1 + vc.norm())) query_.add(i, block_.P[i], now);
    }
}

// Along the velocity field of the body: Runge-Kutta of fourth order.
void StuckPoints::carry(std::size_t i, int o, double now)
{
    const Obstacle& obstacle = block_.obstacles[o];
    list_.push_back(static_cast<std::uint32_t>(i));
    stuck_[i] = 1;
    touched_.set_only_plane(i, -1);
    touched_.add(i);
    Vec3d& P = block_.P[i];
    const auto flow = [&](const Vec3d& x, double s) { return obstacle.shape->velocity_at(x, now + s); };
    const double t = block_.dt[i];
    const Vec3d k1 = flow(P, 0), k2 = flow(P + 0.5 * t * k1, 0.5 * t);
    const Vec3d k3 = flow(P + 0.5 * t * k2, 0.5 * t), k4 = flow(P + t * k3, t);
    P += t / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    block_.v[i] = flow(P, t);
    touched_.set_surface(i, {o, obstacle.normal_at(P, now + t)});
}

}  // namespace rapid

#include "runtime/solver/collision/discrete_methods.h"

#include <algorithm>

#include "runtime/shapes/first_contact.h"
#include "runtime/solver/collision/response.h"

namespace rapid {

void DiscreteMethods::begin()
{
    is_used_ = std::any_of(block_.obstacles.begin(), block_.obstacles.end(),
                           [](const Obstacle& obstacle) { return !obstacle.is_continuous(); });
    position_error_.assign(block_.size(), 0);
}

void DiscreteMethods::correct()
{
    for (std::size_t o = 0; o < block_.obstacles.size(); ++o)
        if (!block_.obstacles[o].is_continuous()) correct(static_cast<int>(o));
}

void DiscreteMethods::correct(int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    ask_about(obstacle);
    if (query_.empty()) return;
    query_.find_gradients_at_times(*obstacle.shape);
    std::size_t backtracked = 0;
    for (std::size_t j = 0; j < query_.size(); ++j)
        if (move_out(j, o)) query_.move(j, backtracked++);
    query_.truncate(backtracked);
    if (!query_.empty()) lift(obstacle);
}

void DiscreteMethods::ask_about(const Obstacle& obstacle)
{
    query_.clear();
    for (std::size_t i = 0; i < block_.size(); ++i) {
        if (!block_.has_member(obstacle, i) || stuck_.has(i)) continue;
        if (obstacle.is_clear_of(block_.P[i], block_.radius(obstacle, i))) continue;
        query_.add(i, block_.P[i], block_.frame_time(i, 0));
    }
}

// Moves a point out of an obstacle. If the field has no gradient, the point returns to its position at the beginning
// of the step. Returns true if the point was backtracked; the query then holds its new position.
bool DiscreteMethods::move_out(std::size_t j, int o)
{
    const Obstacle& obstacle = block_.obstacles[o];
    const std::size_t i = query_.point[j];
    const double slope = query_.gradient[j].norm();
    const double depth = (block_.radius(obstacle, i) - query_.phi[j]) / (slope > 0 ? slope : 1);
    if (!(depth > 0)) return false;
    touched_.add(i);
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const Vec3d P0 = P, v0 = v, vc = obstacle.shape->velocity_at(P0, query_.time[j]);
    const Vec3d n = unit_normal(query_.gradient[j], v0 - vc);
    const double vn = (v0 - vc).dot(n);
    const double bounce = obstacle.restitution(block_.indices[i]), friction = obstacle.friction[block_.indices[i]];
    bool backtracked = false;
    if (obstacle.response == Response::Die || (obstacle.sticks() && !stuck_.is_torn(i, o))) {
        v = vc;
        P = slope > 0 ? Vec3d(P0 + depth * n) : initial_P_[i];
        if (obstacle.response == Response::Die) block_.context.kill(block_.indices[i], block_.time(i, 0));
        if (obstacle.sticks()) stuck_.hold(i, o, 0);
    } else if (!(slope > 0)) {
        P = initial_P_[i];
        v = contact_response(v0, vc, n, bounce, friction);
    } else if (obstacle.method == Method::Project || !(vn < 0)) {
        P += depth * n;
        v = contact_response(v0, vc, n, bounce, friction);
        position_error_[i] = std::max(position_error_[i], (1 + bounce) * depth);
    } else {
        backtrack(i, obstacle, vc, query_.time[j], n, depth);
        query_.P[j] = P;
        backtracked = true;
    }
    if (vn < 0) audit_.add(static_cast<std::size_t>(i), o, {P0, n, vc, -vn, v0, v - v0, block_.time(i, 0)});
    return backtracked;
}

// Moves back along the velocity to the surface, then forward with the velocity after the contact. vc, time: of the
// surface, at the end of the step.
void DiscreteMethods::backtrack(std::size_t i, const Obstacle& obstacle, const Vec3d& vc, double time, const Vec3d& n,
                                double depth)
{
    Vec3d &P = block_.P[i], &v = block_.v[i];
    const double bounce = obstacle.restitution(block_.indices[i]), friction = obstacle.friction[block_.indices[i]];
    const double back = std::min(depth / -(v - vc).dot(n), block_.dt[i]);
    const Vec3d& a = motion_.acceleration(i);
    const Vec3d vc_then = obstacle.shape->velocity_at(P, time - back);
    const Vec3d after = contact_response(v - back * a, vc_then, n, bounce, friction);
    P += back * (after - v + back * a);
    position_error_[i] = std::max(position_error_[i], 0.5 * (1 + bounce) * back * back * a.norm());
    v = after + back * a;
}

// Lifts points that are still below the surface, because a curved shape makes the backtracking time inexact.
void DiscreteMethods::lift(const Obstacle& obstacle)
{
    query_.find_gradients_at_times(*obstacle.shape);
    for (std::size_t j = 0; j < query_.size(); ++j) {
        const std::size_t i = query_.point[j];
        const double slope2 = query_.gradient[j].squaredNorm(), depth = block_.radius(obstacle, i) - query_.phi[j];
        if (depth > 0 && slope2 > 0) block_.P[i] += depth / slope2 * query_.gradient[j];
    }
}

}  // namespace rapid

// Impacts: restitution and friction at the time within a sub-step at which two bodies come to touch.
//
// Free motion takes all points to the end of the sub-step, into one another. A pair that meets on the way is taken back
// along its relative path,
//
//   d(s) = d - u s + a s²/2,   u(s) = u - a s       s: until the end of the sub-step
//
// to where |d(s)| is its reach; there, with n = d(s)/|d(s)| and W = w_i + w_j,
//
//   p = (1 + ε) max(0, -n·u(s)) / W,   |q| <= μ p against the tangential part of u(s), at most to stop it
//   v ± w (p n + q),   P ± w (p n + q) s
//
// An impact acts on the velocities that are there, so that none adds energy, in whichever order they are taken;
// momentum is kept to rounding. A single one is exact where accelerations are constant.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Times are found on straight paths, of the mean velocity, which depends on them: so many times over.
constexpr int path_iterations = 3;

// How long before the end of straight paths two points came to touch, at most `longest`; none where they have not since
// then. d: between their ends, u: relative velocity.
inline std::optional<double> time_of_impact(const Vec3d& d, const Vec3d& u, double reach, double longest)
{
    // a s² - 2 b s + c = 0
    const double a = u.squaredNorm(), b = d.dot(u), c = d.squaredNorm() - reach * reach, root2 = b * b - a * c;
    if (!(root2 > 0)) return {};
    const double root = std::sqrt(root2);
    if (c >= 0 && !(b > 0 && b - root < longest * a)) return {};  // apart at the end, and since `longest`
    const double s = b > 0 ? (b + root) / a : -c / (root - b);
    return std::min(s, longest);
}

// The impulse at an impact with the closing speed -n·u > 0, N s; mass: 1/W.
inline Vec3d impact_impulse(const Vec3d& n, const Vec3d& u, double mass, double restitution, double friction)
{
    const double closing = -n.dot(u), normal = (1 + restitution) * closing * mass;
    const Vec3d sliding = u + closing * n;
    const double speed = sliding.norm();
    if (!(speed > 0)) return normal * n;
    return normal * n - std::min(friction * normal / speed, mass) * sliding;
}

// 1/kg. An impact takes no time, in which drag could act.
inline double impact_inverse_mass(const Substep& step, std::uint32_t i)
{
    return step.points[i].w > 0 ? step.inverse_mass[i] : 0;
}

// What a point accelerates by, m/s²: not where no constraint moves it.
inline Vec3d path_acceleration(const Substep& step, std::uint32_t i)
{
    return step.points[i].w > 0 ? step.paths[i].acceleration : Vec3d(Vec3d::Zero());
}

// Takes an impulse up, so long before the end of the sub-step. What the point was held by until then holds it no more.
inline void take_impulse(Substep& step, std::uint32_t i, const Vec3d& impulse, double since, std::uint32_t sweep)
{
    ProjectedPoint& at = step.points[i];
    if (!(at.w > 0)) return;
    FreePath& path = step.paths[i];
    if (!step.reaction.empty()) step.reaction[i] -= since * path.reaction;
    const Vec3d change = impact_inverse_mass(step, i) * impulse - 0.5 * since * path.reaction;
    at.P += since * change;
    step.v[i] += change - 0.5 * since * path.reaction;
    path.acceleration -= path.reaction;
    path.reaction.setZero();
    path.since = since;
    path.sweep = sweep;
}

}  // namespace rapid

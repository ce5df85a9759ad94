// Impacts: restitution and friction at the time within a substep at which two bodies touch.
//
// Free motion moves all points to the end of the substep, possibly into one another. A pair that meets on its path is
// moved back along its relative path,
//
//   d(s) = d - u s + a s²/2,   u(s) = u - a s       s: time until the end of the substep
//
// to the point at which |d(s)| is its reach. There, with n = d(s)/|d(s)| and W = w_i + w_j,
//
//   p = (1 + ε) max(0, -n·u(s)) / W,   |q| <= μ p against the tangential part of u(s), at most stopping it
//   v ± w (p n + q),   P ± w (p n + q) s
//
// An impact acts on the current velocities, so none adds energy in any order, and momentum is conserved to rounding. A
// single impact is exact for constant accelerations.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Thresholds for resting contact.

// Closing speed, m/s, below which a contact neither bounces nor wakes sleepers: twice the speed that accelerations
// give a point at rest in a substep.
inline double resting_speed(const Substep& step) { return 2.0 * step.max_acceleration * step.dt; }

// Distance below which points may come into contact in the projection, relative to the sum of their radii.
constexpr double near_contact = 1.02;

// Fixed-point iterations for the time of impact: it is found on straight paths, whose mean velocity depends on it.
constexpr int path_iterations = 3;

// Returns how long before the end of straight paths two points came into contact, at most `longest`, or nothing if
// they did not within that time. d: between their ends, u: relative velocity.
inline std::optional<double> time_of_impact(const Vec3d& d, const Vec3d& u, double reach, double longest)
{
    // a s² - 2 b s + c = 0
    const double a = u.squaredNorm(), b = d.dot(u), c = d.squaredNorm() - reach * reach, root2 = b * b - a * c;
    if (!(root2 > 0)) return {};
    const double root = std::sqrt(root2);
    if (c >= 0 && !(b > 0 && b - root < longest * a)) return {};  // apart at the end, and throughout `longest`
    const double s = b > 0 ? (b + root) / a : -c / (root - b);
    return std::min(s, longest);
}

// Returns the impulse of an impact with the closing speed -n·u > 0, N s. mass: 1/W.
inline Vec3d impact_impulse(const Vec3d& n, const Vec3d& u, double mass, double restitution, double friction)
{
    const double closing = -n.dot(u), normal = (1 + restitution) * closing * mass;
    const Vec3d sliding = u + closing * n;
    const double speed = sliding.norm();
    if (!(speed > 0)) return normal * n;
    return normal * n - std::min(friction * normal / speed, mass) * sliding;
}

// Returns the inverse mass in an impact, 1/kg. An impact takes no time in which drag could act.
inline double impact_inverse_mass(const Substep& step, std::uint32_t i)
{
    return step.points[i].w > 0 ? step.inverse_mass[i] : 0;
}

// Returns a point's acceleration, m/s², or 0 if no constraint moves it.
inline Vec3d path_acceleration(const Substep& step, std::uint32_t i)
{
    return step.points[i].w > 0 ? step.paths[i].acceleration : Vec3d(Vec3d::Zero());
}

// Applies an impulse `since` seconds before the end of the substep. The reaction of shapes on the point until then no
// longer acts.
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

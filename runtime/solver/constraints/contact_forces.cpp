#include "runtime/solver/constraints/contact_forces.h"

#include <algorithm>
#include <numeric>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

void ContactForces::include(std::span<const float> radii)
{
    for (std::size_t i = 0; i < radii.size(); ++i) sums_[i].is_recorded |= radii[i] > 0;
}

void ContactForces::begin(const Substep& step, const Sleep* sleep)
{
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        if (sleep && sleep->asleep(i)) continue;
        sums_[i].time += step.dt;
        sums_[i].contacts = 0;
    }
}

double ContactForces::friction_work() const
{
    return std::accumulate(sums_.begin(), sums_.end(), 0.0,
                           [](double sum, const Sum& point) { return sum + point.friction_work; });
}

double ContactForces::shape_work() const
{
    return std::accumulate(sums_.begin(), sums_.end(), 0.0,
                           [](double sum, const Sum& point) { return sum + point.shape_work; });
}

void ContactForces::store(PointSet& points) const
{
    const std::span<float> normal = points.column<float>("normalforce").write();
    const std::span<float> friction = points.column<float>("frictionforce").write();
    const std::span<std::int32_t> contacts = points.column<std::int32_t>("contactnum").write();
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        const Sum& sum = sums_[i];
        if (!sum.is_recorded || !(sum.time > 0)) continue;
        normal[i] = static_cast<float>(sum.normal / sum.time);
        friction[i] = static_cast<float>(sum.tangential / sum.time);
        contacts[i] = sum.contacts;
    }
}

Vec3d split_impulse(const Vec3d& impulse, std::span<const Vec3d> normals, std::span<double> parts)
{
    constexpr int max_sweeps = 32;
    constexpr double found = 1e-9;
    std::fill(parts.begin(), parts.end(), 0.0);
    Vec3d left = impulse;
    double change = impulse.norm();
    for (int sweep = 0; sweep < max_sweeps && change > found * impulse.norm(); ++sweep) {
        change = 0;
        for (std::size_t k = 0; k < normals.size(); ++k) {
            const double by = std::max(-parts[k], left.dot(normals[k]));
            parts[k] += by;
            left -= by * normals[k];
            change = std::max(change, std::abs(by));
        }
    }
    return left;
}

}  // namespace rapid

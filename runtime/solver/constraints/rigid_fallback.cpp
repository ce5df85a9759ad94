#include "runtime/solver/constraints/rigid_fallback.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "runtime/base/parallel.h"
#include "runtime/solver/constraints/energy_bound.h"

namespace rapid {
namespace {

// Returns ω for an angular momentum; its component is 0 along axes without inertia.
Vec3d rotation_rate(const Eigen::Matrix3d& inertia, const Vec3d& momentum)
{
    constexpr double least = 1e-12;  // relative to the largest
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
    Vec3d along = axes.eigenvectors().transpose() * momentum;
    for (int k = 0; k < 3; ++k) {
        const double moment = axes.eigenvalues()[k];
        along[k] = moment > least * axes.eigenvalues()[2] ? along[k] / moment : 0;
    }
    return axes.eigenvectors() * along;
}

}  // namespace

void RigidFallback::begin(const Substep& step)
{
    for (std::vector<Vec3d>* values : {&start_, &P_, &v_}) values->resize(step.size());
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            start_[i] = step.start[i], P_[i] = step.points[i].P, v_[i] = step.v[i];
    });
}

void RigidFallback::apply(Substep& step, std::span<const std::uint32_t> points, const Drive* driver) const
{
    const std::optional<Drive> rest = resting_position(step, points);
    if (driver || rest)
        carry(step, points, driver ? *driver : *rest);
    else
        move(step, points);
}

// Returns the mean motion of the surfaces that points are attached to, at rest if springs attach to positions only;
// nothing if there are no springs.
std::optional<Drive> RigidFallback::resting_position(const Substep& step, std::span<const std::uint32_t> points) const
{
    if (step.mobility.empty()) return {};
    Drive mean;
    double stiffness = 0;  // N/m
    for (const std::uint32_t i : points) {
        const double of_place = step.mobility[i].stiffness / step.inverse_mass[i];
        const SurfaceSpring& spring = step.surface_springs[i];
        const double of_surface = spring.w2 / step.inverse_mass[i];
        stiffness += of_place + of_surface;
        if (!(of_surface > 0)) continue;
        const Vec3d v_before = velocity_of_surface(spring, start_[i], step.dt);
        const Vec3d v = velocity_of_surface(spring, start_[i] + step.dt * v_before, 0);
        const Drive surface = Drive::of(v_before, v, step.dt);
        mean.v += of_surface * surface.v, mean.displacement += of_surface * surface.displacement;
    }
    if (!(stiffness > 0)) return {};
    mean.v /= stiffness, mean.displacement /= stiffness;
    return mean;
}

void RigidFallback::carry(Substep& step, std::span<const std::uint32_t> points, const Drive& driver) const
{
    for (const std::uint32_t i : points) place(step, i, start_[i] + driver.displacement, driver.v);
}

void RigidFallback::move(Substep& step, std::span<const std::uint32_t> points) const
{
    double mass = 0;
    Vec3d middle = Vec3d::Zero(), displacement = Vec3d::Zero(), velocity = Vec3d::Zero();
    for (const std::uint32_t i : points) {
        const double m = 1 / step.inverse_mass[i];
        mass += m;
        middle += m * start_[i];
        displacement += m * (P_[i] - start_[i]);
        velocity += m * v_[i];
    }
    middle /= mass, displacement /= mass, velocity /= mass;

    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Vec3d momentum = Vec3d::Zero();
    for (const std::uint32_t i : points) {
        const double m = 1 / step.inverse_mass[i];
        const Vec3d arm = start_[i] - middle;
        inertia += m * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
        momentum += m * arm.cross(v_[i] - velocity);
    }
    const Vec3d omega = rotation_rate(inertia, momentum);
    for (const std::uint32_t i : points)
        place(step, i, start_[i] + displacement, velocity + omega.cross(start_[i] - middle));
}

// Places a point as if free motion had left it there.
void RigidFallback::place(Substep& step, std::uint32_t i, const Vec3d& P, const Vec3d& v) const
{
    step.displacement[i] += step.dt * (v - step.v[i]);
    step.points[i].P = P;
    step.start[i] = start_[i];
    step.v[i] = v;
}

}  // namespace rapid

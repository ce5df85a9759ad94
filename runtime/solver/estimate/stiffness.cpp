#include "runtime/solver/estimate/stiffness.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "runtime/points/members.h"
#include "runtime/solver/changing.h"
#include "runtime/solver/solve.h"

namespace rapid {
namespace {

// Reporting thresholds. For a drag or spring that is solved exactly: 1 - 1/e of its relaxation per substep.
constexpr double reported_if_exact = 1;
// For others: at half a radian per substep the phase error of the midpoint rule is 1 % of it, (omega dt)² / 24; beyond
// 2 it is unstable. At a quarter, a motion is well resolved.
constexpr double reported_otherwise = 0.5, resolved = 0.25;
constexpr int max_proposed = 256;  // substeps: eight times as many for a few points take about 30 ms with a script
constexpr int reference = 8;       // factor of substeps for the reference, whose error is 1/64 at order 2

// Number of points for Jacobians, and of the stiffest points that are solved.
constexpr std::size_t max_sampled = 64, max_solved = 16;

// Finite difference, relative to the norm of a position and a velocity (at least min_size, m and m/s): rounding in
// double and in the single precision of fields both stay far below.
constexpr double difference = 1e-5, min_size = 1e-3;
constexpr double step_rounding = 1e-6;  // relative error of a step from these differences; ties keep the first

// Returns the indices of points evenly spread over those that the step advances.
std::vector<std::uint32_t> sample_of(const PointSet& points, const std::string& group)
{
    const Strided<std::uint8_t> members = members_of(points, group);
    std::vector<std::uint32_t> indices;
    if (members.stride == 0) {  // all, or none
        const std::size_t n = members[0] ? std::min(points.size(), max_sampled) : 0;
        for (std::size_t k = 0; k < n; ++k) indices.push_back(static_cast<std::uint32_t>(k * points.size() / n));
        return indices;
    }
    std::size_t count = 0, passed = 0;
    for (std::size_t i = 0; i < points.size(); ++i) count += members[i];
    const std::size_t n = std::min(count, max_sampled);
    for (std::size_t i = 0; i < points.size() && indices.size() < n; ++i)
        if (members[i] && passed++ == indices.size() * count / n) indices.push_back(static_cast<std::uint32_t>(i));
    return indices;
}

using Accelerations = std::function<std::vector<Vec3d>(std::span<Vec3d> P, std::span<Vec3d> v)>;

struct Jacobians {
    Eigen::Matrix3d by_position, by_velocity;
};

// The sample points in the middle of their first substep.
class Sample {
public:
    Sample(const PointSet& points, std::span<const std::uint32_t> indices, const SolveOptions& options)
        : set(points.select(indices)), P(set.size()), v(set.size()), dt(set.size(), options.h / options.substeps)
    {
        const Strided<Vec3f> at = std::as_const(set).P().read(), speed = std::as_const(set).v().read();
        if (const auto* own = std::as_const(set).find<float>("dt"))
            for (std::size_t i = 0; i < dt.size(); ++i) dt[i] = double((*own)[i]) / options.substeps;
        for (std::size_t i = 0; i < dt.size(); ++i) {
            P[i] = at[i].cast<double>();
            v[i] = speed[i].cast<double>();
            time.push_back(options.time - dt[i] * (options.substeps - 0.5));
        }
    }

    std::size_t size() const { return P.size(); }

    bool is_member(const Dynamic& dynamic, std::size_t i) const { return members_of(set, dynamic.group)[i]; }

    void evaluate(const Force& force, std::span<Vec3d> at, std::span<Vec3d> speed, Forces& forces) const
    {
        forces.reset(size());
        if (const std::optional<Uniform> uniform = force.uniform())
            forces.add(*uniform);
        else
            force.contribute({set, 0, at, speed, dt, time, 0}, forces);
    }

    // Returns accelerations without the terms -k v of drags and -w2 x of springs, which are solved exactly; their
    // targets may depend on the position.
    std::vector<Vec3d> inexact_accelerations(const Force& force, std::span<Vec3d> at, std::span<Vec3d> speed) const
    {
        Forces forces;
        evaluate(force, at, speed, forces);
        std::vector<Vec3d> a(size());
        for (std::size_t i = 0; i < size(); ++i) {
            a[i] = forces.acceleration(i);
            if (forces.has_linear()) a[i] += forces.linear(i).ku + forces.linear(i).w2q;
        }
        return a;
    }

    // Uses a copy of the set, because an action may write the columns that it reads.
    std::vector<Vec3d> accelerations(const Action& action, std::span<Vec3d> at, std::span<Vec3d> speed) const
    {
        PointSet own = set;
        std::vector<Vec3d> a(size(), Vec3d::Zero()), force = a;
        action.prepare(own);
        const std::unique_ptr<ActionPass> pass = action.begin(own);
        if (!pass) return a;
        const std::vector<Vec3d> before(speed.begin(), speed.end());
        std::vector<std::uint8_t> dead(size(), 0);
        pass->act({own, 0, at, speed, dt, time, 0}, force, dead);
        const auto* masses = std::as_const(own).find<float>("mass");
        for (std::size_t i = 0; i < size(); ++i)
            a[i] = (speed[i] - before[i]) / dt[i] + force[i] / (masses ? double((*masses)[i]) : 1.0);
        return a;
    }

    // Computes the Jacobians by central differences.
    std::vector<Jacobians> jacobians(const Accelerations& accelerations_at) const
    {
        std::vector<Jacobians> result(size());
        const auto difference_along = [&](bool by_position, int axis) {
            const std::span<const Vec3d> from = by_position ? P : v;
            const auto moved_by = [&](double side) {
                std::vector<Vec3d> at = P, speed = v;
                std::vector<Vec3d>& moved = by_position ? at : speed;
                for (std::size_t i = 0; i < size(); ++i)
                    moved[i][axis] += side * difference * std::max(from[i].norm(), min_size);
                return accelerations_at(at, speed);
            };
            const std::vector<Vec3d> more = moved_by(1), less = moved_by(-1);
            for (std::size_t i = 0; i < size(); ++i) {
                const double width = 2 * difference * std::max(from[i].norm(), min_size);
                (by_position ? result[i].by_position : result[i].by_velocity).col(axis) = (more[i] - less[i]) / width;
            }
        };
        for (const bool by_position : {true, false})
            for (int axis = 0; axis < 3; ++axis) difference_along(by_position, axis);
        return result;
    }

    PointSet set;
    std::vector<Vec3d> P, v;
    std::vector<double> dt, time;
};

// Collects the largest steps of each kind for one force or action.
class StiffnessScan {
public:
    explicit StiffnessScan(std::size_t size) : inexact_(size, 0) {}

    void add(Stiffness::Kind kind, std::size_t i, double step)
    {
        if (!std::isfinite(step)) return;
        double& worst = worst_[kind];
        worst = std::max(worst, step);
        if (kind > Stiffness::Spring) inexact_[i] = std::max(inexact_[i], step);
    }

    // Adds the rate of oscillation of x'' = J x + (K - k) x', and the rate of decay by K alone: k is solved exactly.
    void add(std::size_t i, const Jacobians& by, double k, double dt)
    {
        const Eigen::Matrix3d &J = by.by_position, &K = by.by_velocity;
        if (!J.allFinite() || !K.allFinite() || (J.isZero(0) && K.isZero(0))) return;
        Eigen::MatrixXd both(6, 6);
        both << Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity(), J, K - k * Eigen::Matrix3d::Identity();
        // Both use dynamic matrices, because each matrix type takes 12 s to compile.
        const Eigen::EigenSolver<Eigen::MatrixXd> oscillating(both, false);
        add(Stiffness::Oscillation, i, dt * oscillating.eigenvalues().imag().cwiseAbs().maxCoeff());
        const Eigen::EigenSolver<Eigen::MatrixXd> decaying(Eigen::MatrixXd(K), false);
        add(Stiffness::Decay, i, -dt * decaying.eigenvalues().real().minCoeff());
    }

    // Returns the worst part that is solved exactly and the worst that is not, if they are above the threshold.
    std::vector<Stiffness> result() const
    {
        std::vector<Stiffness> result;
        for (const bool exact : {true, false}) {
            Stiffness worst;
            for (const auto& [kind, step] : worst_)
                if ((kind <= Stiffness::Spring) == exact && step > worst.step) worst.kind = kind, worst.step = step;
            if (worst.step >= (exact ? reported_if_exact : reported_otherwise)) result.push_back(worst);
        }
        return result;
    }

    double inexact(std::size_t i) const { return inexact_[i]; }

    // All of it is solved exactly: linear in position and velocity, with constant coefficients.
    bool is_linear = true;

private:
    std::map<Stiffness::Kind, double> worst_;
    std::vector<double> inexact_;  // by point
};

// Scans the angle by which the surface normal turns along the path of the substep, as omega dt of a circle. On a plane
// the motion is exact, and the spring's omega dt is reported.
void scan_surface(const SurfaceSpring& spring, const Sample& sample, std::size_t i, StiffnessScan& found)
{
    if (!(spring.w2 > 0)) return;
    const double dt = sample.dt[i];
    if (spring.shape->half_space()) return found.add(Stiffness::Spring, i, std::sqrt(spring.w2) * dt);
    const std::array<Vec3d, 2> at = {sample.P[i], sample.P[i] + dt * sample.v[i]};
    const std::array<double, 2> time = {spring.time, spring.time + dt};
    std::array<double, 2> phi;
    std::array<Vec3d, 2> gradient;
    spring.shape->distance_at(at, time, phi, gradient);
    const double cosine = gradient[0].dot(gradient[1]);
    found.add(Stiffness::Oscillation, i,
              std::atan2(gradient[0].cross(gradient[1]).norm(), spring.two_sided ? std::abs(cosine) : cosine));
}

StiffnessScan scan(const Force& force, const Sample& sample)
{
    StiffnessScan found(sample.size());
    if (const std::optional<Uniform> uniform = force.uniform(); uniform && uniform->linear.is_zero()) return found;
    std::vector<Vec3d> P = sample.P, v = sample.v;
    Forces forces;
    sample.evaluate(force, P, v, forces);
    const std::vector<Jacobians> jacobians = sample.jacobians(
        [&](std::span<Vec3d> at, std::span<Vec3d> speed) { return sample.inexact_accelerations(force, at, speed); });
    for (std::size_t i = 0; i < sample.size(); ++i) {
        const Linear linear = forces.has_linear() ? forces.linear(i) : Linear();
        const Jacobians& by = jacobians[i];
        found.is_linear &= linear.c == 0 && by.by_position.isZero(0) && by.by_velocity.isZero(0);
        if (forces.has_surface_springs() && forces.surface_spring(i).w2 > 0)
            found.is_linear &= forces.surface_spring(i).shape->half_space().has_value();
        if (!sample.is_member(force, i)) continue;
        const double dt = sample.dt[i];
        found.add(Stiffness::Drag, i, linear.k * dt);
        found.add(Stiffness::Spring, i, std::sqrt(linear.w2) * dt);
        found.add(Stiffness::SquaredDrag, i, linear.c * sample.v[i].norm() * dt);
        if (forces.has_surface_springs()) scan_surface(forces.surface_spring(i), sample, i, found);
        found.add(i, by, linear.k, dt);
    }
    return found;
}

StiffnessScan scan(const Action& action, const Sample& sample)
{
    StiffnessScan found(sample.size());
    const std::vector<Jacobians> jacobians = sample.jacobians(
        [&](std::span<Vec3d> at, std::span<Vec3d> speed) { return sample.accelerations(action, at, speed); });
    for (std::size_t i = 0; i < sample.size(); ++i) found.add(i, jacobians[i], 0, sample.dt[i]);
    return found;
}

// Returns the substeps that resolve the stiffest part that is not solved exactly.
int proposed(const SolveOptions& options, double step)
{
    int substeps = options.substeps;
    for (double left = step; left > resolved && 2 * substeps <= max_proposed; left /= 2) substeps *= 2;
    return substeps;
}

// Returns the largest distance between points of the same id, m.
double largest_distance(const PointSet& a, const PointSet& b)
{
    std::map<std::int64_t, Vec3d> position;
    for (std::size_t i = 0; i < b.size(); ++i) position[b.id()[i]] = b.P()[i].cast<double>();
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const auto found = position.find(a.id()[i]); found != position.end())
            worst = std::max(worst, (a.P()[i].cast<double>() - found->second).norm());
    return worst;
}

Stiffness::Improvement improvement_of(const PointSet& points, const Dynamics& pulls, SolveOptions options, int substeps)
{
    options.loads = nullptr;
    options.sinks = {};
    options.interacts = false;
    const auto solved = [&](int steps) {
        PointSet set = points;
        options.substeps = steps;
        solve(set, pulls, options);
        return set;
    };
    const PointSet now = solved(options.substeps), then = solved(substeps), exact = solved(reference * substeps);
    return {largest_distance(now, exact), substeps, largest_distance(then, exact)};
}

Dynamics forces_and_actions_of(const Dynamics& dynamics)
{
    Dynamics pulls;
    dynamics.visit_in_order([&]<class T>(const std::shared_ptr<const T>& dynamic) {
        if constexpr (std::is_same_v<T, Force> || std::is_same_v<T, Action>) pulls.add(dynamic);
    });
    return pulls;
}

}  // namespace

std::vector<Stiffness> find_stiff(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    const Dynamics pulls = forces_and_actions_of(dynamics);
    std::vector<std::uint32_t> indices = sample_of(points, options.group);
    if (const auto* own = points.find<float>("dt"))  // points born at the frame's end take no step
        std::erase_if(indices, [&](std::uint32_t i) { return !((*own)[i] > 0); });
    if (pulls.empty() || indices.empty()) return {};

    const Sample sample(points, indices, options);
    std::vector<Stiffness> all;
    std::vector<double> inexact(sample.size(), 0);
    double worst = 0;
    bool alone = pulls.size() == dynamics.size();  // no shapes, constraints or interactions
    const auto look_at = [&](const auto& pull, const std::string& name) {
        std::optional<StiffnessScan> found;
        try {
            found = scan(pull, sample);
        } catch (const Error&) {
            return;  // the step itself reports it
        }
        for (Stiffness& stiffness : found->result()) {
            stiffness.node = name;
            stiffness.substeps = options.substeps;
            stiffness.frame = options.frame;
            if (!stiffness.is_exact()) worst = std::max(worst, stiffness.step);
            all.push_back(std::move(stiffness));
        }
        for (std::size_t i = 0; i < sample.size(); ++i) inexact[i] = std::max(inexact[i], found->inexact(i));
        alone &= found->is_linear;
    };
    pulls.visit_in_order([&]<class T>(const std::shared_ptr<const T>& pull) {
        if constexpr (std::is_same_v<T, Force>) {
            look_at(*pull, pull->node);
            alone &= dynamic_cast<const ChangingForce*>(pull.get()) == nullptr;
        } else if constexpr (std::is_same_v<T, Action>) {
            look_at(*pull, fmt::format("action \"{}\"", pull->node));
            alone = false;
        }
    });
    for (Stiffness& stiffness : all) stiffness.alone = alone;
    if (worst == 0 || !dynamics.constraints().empty()) return all;

    std::vector<std::uint32_t> stiffest(sample.size());
    for (std::size_t i = 0; i < stiffest.size(); ++i) stiffest[i] = static_cast<std::uint32_t>(i);
    std::stable_sort(stiffest.begin(), stiffest.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return inexact[a] > inexact[b]; });
    stiffest.resize(std::min(stiffest.size(), max_solved));
    try {
        const Stiffness::Improvement improvement =
            improvement_of(sample.set.select(stiffest), pulls, options, proposed(options, worst));
        for (Stiffness& stiffness : all)
            if (!stiffness.is_exact()) stiffness.improvement = improvement;
    } catch (const Error&) {  // unstable: the run itself reports it
    }
    return all;
}

void keep_worst(std::vector<Stiffness>& worst, const std::vector<Stiffness>& found)
{
    for (const Stiffness& stiffness : found) {
        const auto known = std::find_if(worst.begin(), worst.end(), [&](const Stiffness& other) {
            return other.node == stiffness.node && other.is_exact() == stiffness.is_exact();
        });
        if (known == worst.end()) {
            worst.push_back(stiffness);
            continue;
        }
        const bool alone = known->alone && stiffness.alone;
        if (known->step * (1 + step_rounding) < stiffness.step) *known = stiffness;
        known->alone = alone;
    }
}

std::string text_of(const Stiffness& stiffness)
{
    const char* number = stiffness.kind == Stiffness::SquaredDrag                                  ? "c v dt"
                         : stiffness.kind == Stiffness::Drag || stiffness.kind == Stiffness::Decay ? "k dt"
                                                                                                   : "omega dt";
    const std::string what = fmt::format("{}: {} = {:.3g}", stiffness.node, number, stiffness.step);
    if (stiffness.is_exact())
        return what + (stiffness.alone ? "; treated exactly"
                                       : "; solved in closed form, with what else acts held through a sub-step");
    std::string text = fmt::format("{} at {} sub-step{}", what, stiffness.substeps, stiffness.substeps == 1 ? "" : "s");
    if (const auto& improvement = stiffness.improvement) {
        text += fmt::format("; estimated error {:.1g} m; {} sub-steps would give {:.1g} m", improvement->error,
                            improvement->substeps, improvement->error_after);
        // A converging error falls to a quarter with twice as many substeps.
        if (improvement->error_after > 0.5 * improvement->error)
            text += "; they are no remedy near a place where a force has no bound: attract has core for that";
    }
    return text;
}

}  // namespace rapid

#include "runtime/solver/estimate/stiffness.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "runtime/points/members.h"
#include "runtime/solver/solve.h"

namespace rapid {
namespace {

// From where a drag or spring that is solved exactly is told of: a sub-step in which it does 1 - 1/e of its work.
constexpr double told_if_exact = 1;
// And all else: at half a radian a sub-step the midpoint's phase is off by 1 % of it, (omega dt)² / 24, beyond 2 it
// blows up. At a quarter a motion is followed well.
constexpr double told_otherwise = 0.5, followed = 0.25;
constexpr int most_proposed = 256;  // sub-steps: eight times as many of a few points take some 30 ms, by a script
constexpr int reference = 8;        // times as many, for what is taken as right: its own error is 1/64 at order 2

// Points whose derivatives are taken, and of them, the stiffest, those that are solved.
constexpr std::size_t most_asked = 64, most_solved = 16;

// Differences are taken over this part of a place's and a velocity's size, m and m/s: rounding in double and in the
// single precision of fields both stay far below.
constexpr double difference = 1e-5, least_size = 1e-3;
constexpr double rounding = 1e-6;  // of a step's number, by these differences: what is as bad stays as it was found

// Evenly from all that the step advances.
std::vector<std::uint32_t> sample_of(const PointSet& points, const std::string& group)
{
    const Strided<std::uint8_t> members = members_of(points, group);
    std::size_t count = 0, met = 0;
    for (std::size_t i = 0; i < points.size(); ++i) count += members[i];
    const std::size_t n = std::min(count, most_asked);
    std::vector<std::uint32_t> places;
    for (std::size_t i = 0; i < points.size() && places.size() < n; ++i)
        if (members[i] && met++ == places.size() * count / n) places.push_back(static_cast<std::uint32_t>(i));
    return places;
}

using Accelerations = std::function<std::vector<Vec3d>(std::span<Vec3d> P, std::span<Vec3d> v)>;

struct Derivatives {
    Eigen::Matrix3d by_place, by_velocity;
};

// The sample in the middle of its first sub-step.
class Sample {
public:
    Sample(const PointSet& points, std::span<const std::uint32_t> places, const SolveOptions& options)
        : set(points.select(places)), P(set.size()), v(set.size()), dt(set.size(), options.h / options.substeps)
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

    void ask(const Force& force, std::span<Vec3d> at, std::span<Vec3d> speed, Forces& forces) const
    {
        forces.reset(size());
        if (const std::optional<Uniform> uniform = force.uniform())
            forces.add(*uniform);
        else
            force.contribute({set, 0, at, speed, dt, time, 0}, forces);
    }

    // What a linear part leaves: a drag's own -k v and a spring's -w2 x are solved exactly, what they are drawn to is
    // not where that depends on the place.
    std::vector<Vec3d> rest_of(const Force& force, std::span<Vec3d> at, std::span<Vec3d> speed) const
    {
        Forces forces;
        ask(force, at, speed, forces);
        std::vector<Vec3d> a(size());
        for (std::size_t i = 0; i < size(); ++i) {
            a[i] = forces.acceleration(i);
            if (forces.has_linear()) a[i] += forces.linear(i).ku + forces.linear(i).w2q;
        }
        return a;
    }

    // Of a set of its own each time: an action may write what it reads.
    std::vector<Vec3d> kicks_of(const Action& action, std::span<Vec3d> at, std::span<Vec3d> speed) const
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

    // By central differences.
    std::vector<Derivatives> derivatives(const Accelerations& accelerations) const
    {
        std::vector<Derivatives> result(size());
        const auto difference_along = [&](bool by_place, int axis) {
            const std::span<const Vec3d> from = by_place ? P : v;
            const auto asked = [&](double side) {
                std::vector<Vec3d> at = P, speed = v;
                std::vector<Vec3d>& moved = by_place ? at : speed;
                for (std::size_t i = 0; i < size(); ++i)
                    moved[i][axis] += side * difference * std::max(from[i].norm(), least_size);
                return accelerations(at, speed);
            };
            const std::vector<Vec3d> more = asked(1), less = asked(-1);
            for (std::size_t i = 0; i < size(); ++i) {
                const double way = 2 * difference * std::max(from[i].norm(), least_size);
                (by_place ? result[i].by_place : result[i].by_velocity).col(axis) = (more[i] - less[i]) / way;
            }
        };
        for (const bool by_place : {true, false})
            for (int axis = 0; axis < 3; ++axis) difference_along(by_place, axis);
        return result;
    }

    PointSet set;
    std::vector<Vec3d> P, v;
    std::vector<double> dt, time;
};

// The stiffest points of each kind, for one force or action.
class Found {
public:
    explicit Found(std::size_t size) : inexact_(size, 0) {}

    void add(Stiffness::Kind kind, std::size_t i, double step)
    {
        if (!std::isfinite(step)) return;
        double& worst = worst_[kind];
        worst = std::max(worst, step);
        if (kind > Stiffness::Spring) inexact_[i] = std::max(inexact_[i], step);
    }

    // How fast x'' = J x + (K - k) x' turns, and how fast K alone takes a velocity away: that of k is exact.
    void add(std::size_t i, const Derivatives& by, double k, double dt)
    {
        const Eigen::Matrix3d &J = by.by_place, &K = by.by_velocity;
        if (!J.allFinite() || !K.allFinite() || (J.isZero(0) && K.isZero(0))) return;
        Eigen::Matrix<double, 6, 6> both;
        both << Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity(), J, K - k * Eigen::Matrix3d::Identity();
        const Eigen::EigenSolver<Eigen::Matrix<double, 6, 6>> turning(both, false);
        add(Stiffness::Turning, i, dt * turning.eigenvalues().imag().cwiseAbs().maxCoeff());
        const Eigen::EigenSolver<Eigen::Matrix3d> decaying(K, false);
        add(Stiffness::Decay, i, -dt * decaying.eigenvalues().real().minCoeff());
    }

    // The worst of what is exact and the worst of what is not, where they are worth a word.
    std::vector<Stiffness> told() const
    {
        std::vector<Stiffness> told;
        for (const bool exact : {true, false}) {
            Stiffness worst;
            for (const auto& [kind, step] : worst_)
                if ((kind <= Stiffness::Spring) == exact && step > worst.step) worst.kind = kind, worst.step = step;
            if (worst.step >= (exact ? told_if_exact : told_otherwise)) told.push_back(worst);
        }
        return told;
    }

    double inexact(std::size_t i) const { return inexact_[i]; }

private:
    std::map<Stiffness::Kind, double> worst_;
    std::vector<double> inexact_;  // by point
};

Found ask(const Force& force, const Sample& sample)
{
    Found found(sample.size());
    if (const std::optional<Uniform> uniform = force.uniform(); uniform && uniform->linear.is_zero()) return found;
    std::vector<Vec3d> P = sample.P, v = sample.v;
    Forces forces;
    sample.ask(force, P, v, forces);
    const std::vector<Derivatives> derivatives = sample.derivatives(
        [&](std::span<Vec3d> at, std::span<Vec3d> speed) { return sample.rest_of(force, at, speed); });
    for (std::size_t i = 0; i < sample.size(); ++i) {
        if (!sample.is_member(force, i)) continue;
        const Linear linear = forces.has_linear() ? forces.linear(i) : Linear();
        const double dt = sample.dt[i];
        found.add(Stiffness::Drag, i, linear.k * dt);
        found.add(Stiffness::Spring, i, std::sqrt(linear.w2) * dt);
        found.add(Stiffness::SquaredDrag, i, linear.c * sample.v[i].norm() * dt);
        found.add(i, derivatives[i], linear.k, dt);
    }
    return found;
}

Found ask(const Action& action, const Sample& sample)
{
    Found found(sample.size());
    const std::vector<Derivatives> derivatives = sample.derivatives(
        [&](std::span<Vec3d> at, std::span<Vec3d> speed) { return sample.kicks_of(action, at, speed); });
    for (std::size_t i = 0; i < sample.size(); ++i) found.add(i, derivatives[i], 0, sample.dt[i]);
    return found;
}

// The sub-steps at which the stiffest of what is not exact is followed.
int proposed(const SolveOptions& options, double step)
{
    int substeps = options.substeps;
    for (double left = step; left > followed && 2 * substeps <= most_proposed; left /= 2) substeps *= 2;
    return substeps;
}

// m, the largest distance of a point to itself.
double apart(const PointSet& a, const PointSet& b)
{
    std::map<std::int64_t, Vec3d> place;
    for (std::size_t i = 0; i < b.size(); ++i) place[b.id()[i]] = b.P()[i].cast<double>();
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const auto found = place.find(a.id()[i]); found != place.end())
            worst = std::max(worst, (a.P()[i].cast<double>() - found->second).norm());
    return worst;
}

Stiffness::Cure cure_of(const PointSet& points, const Dynamics& pulls, SolveOptions options, int substeps)
{
    options.loads = nullptr;
    const auto solved = [&](int steps) {
        PointSet set = points;
        options.substeps = steps;
        solve(set, pulls, options);
        return set;
    };
    const PointSet as_it_is = solved(options.substeps), then = solved(substeps), right = solved(reference * substeps);
    return {apart(as_it_is, right), substeps, apart(then, right)};
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
    std::vector<std::uint32_t> places = sample_of(points, options.group);
    if (const auto* own = points.find<float>("dt"))  // those born at the frame's end take no step
        std::erase_if(places, [&](std::uint32_t place) { return !((*own)[place] > 0); });
    if (pulls.empty() || places.empty()) return {};

    const Sample sample(points, places, options);
    std::vector<Stiffness> all;
    std::vector<double> inexact(sample.size(), 0);
    double worst = 0;
    const auto look_at = [&](const auto& pull, const std::string& name) {
        std::optional<Found> found;
        try {
            found = ask(pull, sample);
        } catch (const Error&) {
            return;  // the step itself reports it
        }
        for (Stiffness& stiffness : found->told()) {
            stiffness.node = name;
            stiffness.substeps = options.substeps;
            stiffness.frame = options.frame;
            if (!stiffness.is_exact()) worst = std::max(worst, stiffness.step);
            all.push_back(std::move(stiffness));
        }
        for (std::size_t i = 0; i < sample.size(); ++i) inexact[i] = std::max(inexact[i], found->inexact(i));
    };
    pulls.visit_in_order([&]<class T>(const std::shared_ptr<const T>& pull) {
        if constexpr (std::is_same_v<T, Force>)
            look_at(*pull, pull->node);
        else if constexpr (std::is_same_v<T, Action>)
            look_at(*pull, fmt::format("action \"{}\"", pull->node));
    });
    if (worst == 0 || !dynamics.constraints().empty()) return all;

    std::vector<std::uint32_t> stiffest(sample.size());
    for (std::size_t i = 0; i < stiffest.size(); ++i) stiffest[i] = static_cast<std::uint32_t>(i);
    std::stable_sort(stiffest.begin(), stiffest.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return inexact[a] > inexact[b]; });
    stiffest.resize(std::min(stiffest.size(), most_solved));
    try {
        const Stiffness::Cure cure = cure_of(sample.set.select(stiffest), pulls, options, proposed(options, worst));
        for (Stiffness& stiffness : all)
            if (!stiffness.is_exact()) stiffness.cure = cure;
    } catch (const Error&) {  // it blows up: then the run says so
    }
    return all;
}

void keep_worst(std::vector<Stiffness>& worst, const std::vector<Stiffness>& found)
{
    for (const Stiffness& stiffness : found) {
        const auto known = std::find_if(worst.begin(), worst.end(), [&](const Stiffness& other) {
            return other.node == stiffness.node && other.is_exact() == stiffness.is_exact();
        });
        if (known == worst.end())
            worst.push_back(stiffness);
        else if (known->step * (1 + rounding) < stiffness.step)
            *known = stiffness;
    }
}

std::string text_of(const Stiffness& stiffness)
{
    const char* number = stiffness.kind == Stiffness::SquaredDrag                                  ? "c v dt"
                         : stiffness.kind == Stiffness::Drag || stiffness.kind == Stiffness::Decay ? "k dt"
                                                                                                   : "omega dt";
    const std::string what = fmt::format("{}: {} = {:.3g}", stiffness.node, number, stiffness.step);
    if (stiffness.is_exact()) return what + "; treated exactly";
    std::string text = fmt::format("{} at {} sub-step{}", what, stiffness.substeps, stiffness.substeps == 1 ? "" : "s");
    if (const auto& cure = stiffness.cure)
        text += fmt::format("; estimated error {:.1g} m; {} sub-steps would give {:.1g} m", cure->error, cure->substeps,
                            cure->error_then);
    return text;
}

}  // namespace rapid

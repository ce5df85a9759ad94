// Contacts: the search for all pairs among a million points, and a collapsing column of grains, solved by coloured
// Gauss-Seidel and by averaged Jacobi.
//
// The column is a slightly irregular lattice of spheres with a radius of 0.02 m, 2.1 radii apart. It is as deep as wide
// and four times as high, against the wall of a box three times as long. Another column has three sizes, 1 : 3 : 10,
// with the large ones below. Frames of 1/24 s, for 2 s, with ten substeps of one iteration: 10,000 grains of one size
// then end with the 99th percentile of overlaps below 0.05 of the smaller radius, and all below 0.15. Three sizes have
// larger overlaps, because the error of a substep grows as g dt²/r and the small ones have r = 0.008 m. Compare the
// ratios of one run, not figures of different runs.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/solver/constraints/contacts.h"
#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/solve.h"
#include "tests/solver/motion/uniform_force.h"

namespace rapid {
namespace {

class Spheres : public Constraint {
public:
    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        contacts->follow(points, options, group);
        return contacts;
    }
    ContactOptions options;
    std::shared_ptr<Contacts> contacts = std::make_shared<Contacts>();
};

void search(benchmark::State& state)
{
    const auto n = static_cast<std::size_t>(state.range(0));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
    std::mt19937 random(1);
    std::uniform_real_distribution<double> in(0, 1);
    std::vector<Vec3d> at(n);
    for (Vec3d& x : at) x = Vec3d(in(random), in(random), in(random));
    // On average 3.5 other points lie within twice the radius of each point.
    const float radius = static_cast<float>(0.5 * std::cbrt(3.5 / (static_cast<double>(n) * 4 / 3 * EIGEN_PI)));
    const RadiusGrids grids({&radius, 0}, n, 0, 1);
    ContactSearch contacts;
    Pairs pairs;
    for (auto _ : state) contacts.find(at, {&radius, 0}, grids, pairs);
    state.SetItemsProcessed(static_cast<std::int64_t>(n) * state.iterations());
    state.counters["neighbours"] = 2.0 * static_cast<double>(pairs.size()) / static_cast<double>(n);
}
BENCHMARK(search)->Args({1000000, 1})->Args({1000000, 2})->Unit(benchmark::kMillisecond);

struct Column {
    PointSet points;
    double width = 0;

    void layer(std::size_t n, float r, std::mt19937& random)
    {
        std::uniform_real_distribution<float> off(-0.02f * r, 0.02f * r);
        const float step = 2.1f * r;
        const std::size_t side = std::max<std::size_t>(1, static_cast<std::size_t>(width / step + 1e-6));
        const std::size_t first = points.size();
        points.append(n);
        auto P = points.P().write();
        auto id = points.id().write();
        auto radius = points.column<float>("pscale").write(), mass = points.column<float>("mass").write();
        for (std::size_t i = 0; i < n; ++i) {
            P[first + i] = Vec3f(step * (static_cast<float>(i % side) + 0.5f) + off(random),
                                 top + step * (static_cast<float>(i / side / side) + 0.5f) + off(random),
                                 step * (static_cast<float>(i / side % side) + 0.5f) + off(random));
            id[first + i] = static_cast<std::int64_t>(first + i);
            radius[first + i] = r;
            mass[first + i] = 1e4f * r * r * r;
        }
        top += step * static_cast<float>((n - 1) / side / side + 1);
    }

    Column(std::size_t n, bool three_sizes)
    {
        points.add({"pscale", 0.02f});
        points.add({"mass", 1.0f});
        std::mt19937 random(1);
        if (three_sizes) {
            width = 2.1 * 0.08 * 2;
            layer(n / 500, 0.08f, random);
            layer(n * 98 / 1000, 0.024f, random);
            layer(n - n / 500 - n * 98 / 1000, 0.008f, random);
        } else {
            width = 2.1 * 0.02 * std::round(std::cbrt(static_cast<double>(n) / 4));
            layer(n, 0.02f, random);
        }
    }

private:
    float top = 0;
};

// Overlaps of touching pairs, in units of the smaller radius.
struct Overlaps {
    double p99 = 0, worst = 0;

    Overlaps() = default;
    explicit Overlaps(const PointSet& points)
    {
        const std::size_t n = points.size();
        const auto& radius = points.column<float>("pscale");
        std::vector<float> r(n);
        std::vector<Vec3d> P(n);
        for (std::size_t i = 0; i < n; ++i) r[i] = radius[i], P[i] = points.P()[i].cast<double>();
        Pairs pairs;
        ContactSearch().find(P, {r.data(), 1}, RadiusGrids({r.data(), 1}, n, 0.001, 8), pairs);
        std::vector<double> all;
        for (std::size_t i = 0; i < n; ++i)
            for (const std::uint32_t j : pairs.of(i))
                all.push_back((double(r[i]) + double(r[j]) - (P[i] - P[j]).norm()) / std::min(r[i], r[j]));
        if (all.empty()) return;
        std::sort(all.begin(), all.end());
        p99 = all[static_cast<std::size_t>(0.99 * static_cast<double>(all.size() - 1))];
        worst = all.back();
    }
};

// The rows of contacts.h solved by averaged Jacobi (Macklin et al. 2014). All rows start from the same positions and
// velocities, and each correction is divided by the larger number of rows that act on one of its two points, so
// momentum is conserved. For spheres of equal mass without bounce; on one thread.
class AveragedJacobi : public Coupling {
public:
    double relaxation = 1;  // factor on each correction (Macklin et al.: 1 to 2)

    void follow(const PointSet& points, const ContactOptions& options)
    {
        const auto& radius = points.column<float>("pscale");
        radius_.resize(points.size());
        for (std::size_t i = 0; i < radius_.size(); ++i) radius_[i] = radius[i];
        friction_ = options.friction.read(points)[0];
    }

    void detect(Substep& step) override
    {
        if (near_.begin.empty() || list_.expired(step) || !list_.strays().empty()) {
            list_.build(step, radius_, RadiusGrids({radius_.data(), 1}, step.size(), {}, 8));
            before_ = std::exchange(near_, list_.pairs());
            take_over();
        }
        rows_.clear();
        for (std::uint32_t i = 0; i < step.size(); ++i)
            for (std::uint32_t k = near_.begin[i]; k < near_.begin[i + 1]; ++k) enter(i, k, step);
    }

    void warm_start(Substep& step) override
    {
        for (Row& row : rows_)
            row.change = row.normal_impulse * row.n + 0.5 * row.tangential_impulse, row.shift.setZero();
        apply(step, step.dt, /*averaged=*/false);
    }

    void project(Substep& step) override
    {
        for (Row& row : rows_) {
            const double C = row.n.dot(step.points[row.i].P - step.points[row.j].P) - row.reach - row.allowed;
            const double target = std::max(0.0, row.normal_impulse - C / step.dt * row.per_w);
            row.change.setZero();
            row.shift = step.dt * (target - row.normal_impulse) * row.n;
        }
        apply(step, 0, true);
        for (Row& row : rows_) row.normal_impulse += row.n.dot(row.shift) / step.dt;
    }

    void solve_velocities(Substep& step) override
    {
        for (int k = 1; k <= step.iterations; ++k) solve_velocities_once(step, k == step.iterations);
        for (const Row& row : rows_)
            normal_impulse_[row.pair] = row.normal_impulse, tangential_impulse_[row.pair] = row.tangential_impulse;
    }

    void close(Substep&, FrameFigures&) override {}

private:
    struct Row {
        std::uint32_t i, j, pair;
        double reach, allowed, normal_impulse, carried, per_w;
        Vec3d n, tangential_impulse;
        Vec3d change, shift;  // N s and kg m: a pass's change of momentum and of mass times position
    };

    void enter(std::uint32_t i, std::uint32_t k, const Substep& step)
    {
        const std::uint32_t j = near_.other[k];
        const Vec3d d = step.points[i].P - step.points[j].P;
        const double reach = double(radius_[i]) + double(radius_[j]);
        if (d.squaredNorm() > 1.02 * 1.02 * reach * reach && !(normal_impulse_[k] > 0)) return;
        Row row;
        row.i = i, row.j = j, row.pair = k;
        row.reach = reach;
        row.allowed = std::min(0.0, (step.start[i] - step.start[j]).norm() - reach);
        row.normal_impulse = row.carried = 0.5 * normal_impulse_[k];
        row.per_w = 1 / (step.points[i].w + step.points[j].w);
        row.n = d.normalized();
        row.tangential_impulse = tangential_impulse_[k] - row.n.dot(tangential_impulse_[k]) * row.n;
        rows_.push_back(row);
    }

    void solve_velocities_once(Substep& step, bool last)
    {
        for (Row& row : rows_) {
            const Vec3d relative = step.v[row.i] - step.v[row.j];
            const double closing = row.n.dot(relative), before = row.normal_impulse + row.carried;
            const double overlap = row.reach - row.n.dot(step.points[row.i].P - step.points[row.j].P);
            row.normal_impulse = before, row.carried = 0;
            row.change.setZero(), row.shift.setZero();
            if (!(before > 0) && !(overlap > 0)) continue;
            const double p = std::max(0.0, before - closing * row.per_w);
            const Vec3d sticking = row.tangential_impulse - (relative - closing * row.n) * row.per_w;
            const Vec3d rub = std::min(1.0, friction_ * p / sticking.norm()) * sticking - row.tangential_impulse;
            row.change = (p - before) * row.n + rub;
            row.shift = 0.5 * step.dt * rub;
            if (last) row.shift += 0.8 * std::max(0.0, overlap - 1e-4 * row.reach) * row.per_w * row.n;
        }
        apply(step, 0, true);
        for (Row& row : rows_) {
            const double normal_impulse = row.n.dot(row.change);
            row.normal_impulse += normal_impulse;
            row.tangential_impulse += row.change - normal_impulse * row.n;
        }
    }

    // Applies each row's change to its points, and to their positions as well, over this many seconds.
    void apply(Substep& step, double over, bool averaged)
    {
        count_.assign(step.size(), 0);
        for (const Row& row : rows_)
            if (!row.change.isZero(0) || !row.shift.isZero(0)) ++count_[row.i], ++count_[row.j];
        moved_.assign(step.size(), {Vec3d::Zero(), Vec3d::Zero()});
        for (Row& row : rows_) {
            const double part =
                averaged ? relaxation / std::max<std::uint32_t>(1, std::max(count_[row.i], count_[row.j])) : 1;
            row.change *= part;
            row.shift *= part;
            const Vec3d place = row.shift + over * row.change;
            moved_[row.i][0] += place, moved_[row.j][0] -= place;
            moved_[row.i][1] += row.change, moved_[row.j][1] -= row.change;
        }
        for (std::size_t i = 0; i < step.size(); ++i) {
            step.points[i].P += step.points[i].w * moved_[i][0];
            step.v[i] += step.points[i].w * moved_[i][1];
        }
    }

    void take_over()
    {
        const std::vector<double> normal_impulse = std::move(normal_impulse_);
        const std::vector<Vec3d> tangential_impulse = std::move(tangential_impulse_);
        normal_impulse_.assign(near_.size(), 0);
        tangential_impulse_.assign(near_.size(), Vec3d::Zero());
        for (std::uint32_t i = 0; i + 1 < before_.begin.size(); ++i)
            for (std::uint32_t k = before_.begin[i]; k < before_.begin[i + 1]; ++k) {
                const auto here = near_.of(i);
                const auto found = std::lower_bound(here.begin(), here.end(), before_.other[k]);
                if (found == here.end() || *found != before_.other[k]) continue;
                const std::size_t to = near_.begin[i] + static_cast<std::size_t>(found - here.begin());
                normal_impulse_[to] = normal_impulse[k], tangential_impulse_[to] = tangential_impulse[k];
            }
    }

    std::vector<float> radius_;
    double friction_ = 0;
    NeighbourList list_;
    Pairs near_, before_;
    std::vector<double> normal_impulse_;
    std::vector<Vec3d> tangential_impulse_;
    std::vector<Row> rows_;
    std::vector<std::uint32_t> count_;
    std::vector<std::array<Vec3d, 2>> moved_;  // kg m, N s
};

class JacobiSpheres : public Constraint {
public:
    std::shared_ptr<Coupling> begin(const PointSet& points, double) const override
    {
        rows->follow(points, options);
        return rows;
    }
    ContactOptions options;
    std::shared_ptr<AveragedJacobi> rows = std::make_shared<AveragedJacobi>();
};

// s of rest after which points sleep, the default of the Solve node.
constexpr double default_sleep = 0.25;

// Advances the column by this many frames with these contacts; after_frame is not timed.
template <class F>
PointSet collapse(benchmark::State& state, const Column& start, std::shared_ptr<const Constraint> contacts,
                  std::int64_t frames, int substeps, int iterations, double sleep, const F& after_frame)
{
    PointSet points = start.points;
    points.add({"still", 0.0f});
    Dynamics dynamics = test::chain(std::make_shared<test::UniformForce>(), contacts);
    const double w = start.width;
    for (const auto& [normal, offset] :
         {std::pair(Vec3d(0, 1, 0), 0.0), std::pair(Vec3d(1, 0, 0), 0.0), std::pair(Vec3d(-1, 0, 0), -3 * w),
          std::pair(Vec3d(0, 0, 1), 0.0), std::pair(Vec3d(0, 0, -1), -w)}) {
        auto wall = std::make_shared<Collider>();
        wall->shape = make_plane(normal, offset);
        wall->bounce = 0.0f;
        wall->friction = 0.3f;
        dynamics.add(wall);
    }
    ShapeLoads loads;
    SolveOptions options;
    options.h = 1.0 / 24;
    options.substeps = substeps;
    options.iterations = iterations;
    options.loads = &loads;
    SleepRecords sleep_records;
    options.sleep = sleep;
    options.sleep_records = &sleep_records;
    for (options.frame = 1; options.frame <= frames; ++options.frame) {
        options.time = static_cast<double>(options.frame) * options.h;
        solve(points, dynamics, options);
        state.PauseTiming();
        after_frame(points);
        state.ResumeTiming();
    }
    return points;
}

void column(benchmark::State& state)
{
    const auto n = static_cast<std::size_t>(state.range(0));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
    const std::int64_t sizes = state.range(2), substeps = state.range(3), frames = state.range(4);
    const Column start(n, sizes == 3);
    Overlaps overlaps;
    for (auto _ : state) {
        const auto spheres = std::make_shared<Spheres>();
        spheres->options.friction = 0.3f;
        overlaps = Overlaps(collapse(state, start, spheres, frames, static_cast<int>(substeps), 1, default_sleep,
                                     [](const PointSet&) {}));
    }
    state.SetItemsProcessed(frames * state.iterations());  // frames a second
    state.counters["p99"] = overlaps.p99;
    state.counters["worst"] = overlaps.worst;
}
BENCHMARK(column)
    ->ArgNames({"points", "threads", "sizes", "substeps", "frames"})
    ->Args({10000, 1, 1, 10, 48})
    ->Args({10000, 2, 1, 10, 48})
    ->Args({30000, 1, 1, 10, 48})
    ->Args({100000, 1, 1, 10, 48})
    ->Args({10000, 1, 3, 14, 48})
    ->Args({10000, 1, 1, 10, 6})
    ->Args({1000000, 1, 1, 10, 6})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

// Error against time for the column of 10,000 on one thread: coloured Gauss-Seidel, and averaged Jacobi with a
// relaxation given in tenths. The overlaps are means over all frames.
template <bool jacobi>
void contacts_by(benchmark::State& state)
{
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    constexpr int frames = 48;
    const Column start(10000, false);
    double p99 = 0, worst = 0;
    for (auto _ : state) {
        std::shared_ptr<const Constraint> contacts;
        if constexpr (jacobi) {
            const auto spheres = std::make_shared<JacobiSpheres>();
            spheres->options.friction = 0.3f;
            spheres->rows->relaxation = 0.1 * static_cast<double>(state.range(2));
            contacts = spheres;
        } else {
            const auto spheres = std::make_shared<Spheres>();
            spheres->options.friction = 0.3f;
            contacts = spheres;
        }
        p99 = worst = 0;
        // Points never sleep, so the overlaps come from the iterations alone.
        constexpr double never = std::numeric_limits<double>::infinity();
        collapse(state, start, contacts, frames, static_cast<int>(state.range(0)), static_cast<int>(state.range(1)),
                 never, [&](const PointSet& points) {
                     const Overlaps overlaps(points);
                     p99 += overlaps.p99 / frames;
                     worst += overlaps.worst / frames;
                 });
    }
    state.SetItemsProcessed(frames * state.iterations());
    state.counters["p99"] = p99;
    state.counters["worst"] = worst;
}
BENCHMARK_TEMPLATE(contacts_by, false)
    ->ArgNames({"substeps", "iterations"})
    ->Args({6, 1})
    ->Args({11, 1})
    ->Args({11, 4})
    ->Args({22, 1})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);
BENCHMARK_TEMPLATE(contacts_by, true)
    ->ArgNames({"substeps", "iterations", "tenths"})
    ->Args({11, 1, 10})
    ->Args({11, 4, 10})
    ->Args({22, 1, 10})
    ->Args({22, 1, 15})
    ->Args({44, 1, 10})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

}  // namespace
}  // namespace rapid

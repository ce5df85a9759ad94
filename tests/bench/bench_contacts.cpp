// Contacts: the search for all pairs of a million points, a column of grain that collapses, and a chain that swings.
//
// The column is a lattice of spheres of 0.02 m, 2.1 radii apart and a little out of line, 14 by 14 wide, against the
// wall of a box three times as long; or of three sizes, 1 : 4 : 16, the large below. Frames of 1/24 s, for 2 s, of 11
// sub-steps: as few as leave the deepest 1 % of overlaps of one size below 0.05 of the smaller radius, and all below
// 0.15, at the end.
// Compare the ratios of one run, not figures of different ones.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "runtime/shapes/analytic.h"
#include "runtime/solver/contacts.h"
#include "runtime/solver/shape_contacts.h"
#include "runtime/solver/solve.h"
#include "tests/solver/uniform_force.h"

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
    // 3.5 of the others within twice the radius of each.
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
            layer(n * 98 / 1000, 0.02f, random);
            layer(n - n / 500 - n * 98 / 1000, 0.005f, random);
        } else {
            width = 2.1 * 0.02 * std::round(std::cbrt(static_cast<double>(n) / 4));
            layer(n, 0.02f, random);
        }
    }

private:
    float top = 0;
};

// Of pairs that touch, in smaller radii.
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

void column(benchmark::State& state)
{
    const auto n = static_cast<std::size_t>(state.range(0));
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
    const Column start(n, state.range(2) != 0);
    constexpr int frames = 48;
    Overlaps overlaps;
    for (auto _ : state) {
        PointSet points = start.points;
        const auto spheres = std::make_shared<Spheres>();
        spheres->options.friction = 0.3f;
        std::vector<DynamicPtr> dynamics = {std::make_shared<test::UniformForce>(), spheres};
        const double w = start.width;
        for (const auto& [normal, offset] :
             {std::pair(Vec3d(0, 1, 0), 0.0), std::pair(Vec3d(1, 0, 0), 0.0), std::pair(Vec3d(-1, 0, 0), -3 * w),
              std::pair(Vec3d(0, 0, 1), 0.0), std::pair(Vec3d(0, 0, -1), -w)}) {
            auto wall = std::make_shared<Collider>();
            wall->shape = make_plane(normal, offset);
            wall->bounce = 0.0f;
            wall->friction = 0.3f;
            dynamics.push_back(wall);
        }
        ShapeLoads loads;
        SolveOptions options;
        options.h = 1.0 / 24;
        options.substeps = 11;
        options.loads = &loads;
        for (options.frame = 1; options.frame <= frames; ++options.frame) {
            options.time = static_cast<double>(options.frame) * options.h;
            solve(points, dynamics, options);
        }
        overlaps = Overlaps(points);
    }
    state.SetItemsProcessed(frames * state.iterations());  // frames a second
    state.counters["p99"] = overlaps.p99;
    state.counters["worst"] = overlaps.worst;
}
BENCHMARK(column)
    ->Args({10000, 1, 0})
    ->Args({10000, 2, 0})
    ->Args({30000, 1, 0})
    ->Args({10000, 1, 1})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

}  // namespace
}  // namespace rapid

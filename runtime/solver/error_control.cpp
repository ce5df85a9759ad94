#include "runtime/solver/error_control.h"

#include <algorithm>
#include <cstdint>

namespace rapid {
namespace {

constexpr std::uint32_t gone = UINT32_MAX;

// For each point of `before` its place in `after`, which has the same order; `gone` where it has died.
std::vector<std::uint32_t> places_after(const PointSet& before, const PointSet& after)
{
    const Strided<std::int64_t> id = before.id().read(), left = after.id().read();
    std::vector<std::uint32_t> places(before.size(), gone);
    for (std::size_t i = 0, j = 0; i < before.size() && j < after.size(); ++i)
        if (id[i] == left[j]) places[i] = static_cast<std::uint32_t>(j++);
    return places;
}

double estimate(const Vec3f& coarse, const Vec3f& fine)
{
    return 2 * (coarse.cast<double>() - fine.cast<double>()).norm();
}

SolveOptions with_substeps(SolveOptions options, int substeps)
{
    options.substeps = substeps;
    return options;
}

}  // namespace

PointSet sample_of(const PointSet& points)
{
    const std::size_t n = std::min(points.size(), error_sample);
    std::vector<std::uint32_t> places(n);
    for (std::size_t k = 0; k < n; ++k) places[k] = static_cast<std::uint32_t>(k * points.size() / n);
    return points.select(places);
}

std::vector<double> estimate_errors(const PointSet& sample, std::span<const DynamicPtr> dynamics,
                                    const SolveOptions& options)
{
    PointSet coarse = sample, fine = sample;
    solve(coarse, dynamics, options);
    solve(fine, dynamics, with_substeps(options, 2 * options.substeps));
    const std::vector<std::uint32_t> a = places_after(sample, coarse), b = places_after(sample, fine);
    const Strided<Vec3f> P = std::as_const(coarse).P().read(), Q = std::as_const(fine).P().read();
    std::vector<double> errors;
    for (std::size_t i = 0; i < sample.size(); ++i)
        if (a[i] != gone && b[i] != gone) errors.push_back(estimate(P[a[i]], Q[b[i]]));
    return errors;
}

Tolerated solve_within(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options,
                       double tolerance, int max_substeps)
{
    Tolerated done;
    done.substeps = options.substeps;
    const PointSet start = points;
    std::vector<std::uint32_t> places(points.size());  // in `start`, of those that are solved again
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<std::uint32_t>(i);
    std::vector<std::uint8_t> alive(points.size(), 1);

    // What a run makes of the points of `begin`; where it counts, it is the points' own.
    const auto accept = [&](const PointSet& begin, const PointSet& end, const std::vector<std::uint32_t>& where) {
        const std::vector<std::uint32_t> after = places_after(begin, end);
        std::vector<std::uint32_t> from, to;
        for (std::size_t i = 0; i < where.size(); ++i) {
            alive[where[i]] = after[i] != gone;
            if (after[i] == gone) continue;
            from.push_back(after[i]);
            to.push_back(where[i]);
        }
        points.put(to, end.select(from));
    };

    PointSet begin = start, coarse = start;
    done.result = solve(coarse, dynamics, options);
    accept(begin, coarse, places);
    for (int substeps = 2 * options.substeps; !places.empty(); substeps *= 2) {
        PointSet fine = begin;
        const SolveResult result = solve(fine, dynamics, with_substeps(options, substeps));
        done.result.penetration_max = std::max(done.result.penetration_max, result.penetration_max);
        const std::vector<std::uint32_t> a = places_after(begin, coarse), b = places_after(begin, fine);
        const Strided<Vec3f> P = std::as_const(coarse).P().read(), Q = std::as_const(fine).P().read();
        std::vector<std::uint32_t> again, still;  // in this round's set, and in `start`
        for (std::size_t i = 0; i < places.size(); ++i) {
            const bool both = a[i] != gone && b[i] != gone;
            const double error = both ? estimate(P[a[i]], Q[b[i]]) : 0;
            const bool good = both ? error <= tolerance : a[i] == b[i];
            if (both && (good || substeps > max_substeps)) done.errors.push_back(error);
            if (good) continue;
            again.push_back(static_cast<std::uint32_t>(i));
            still.push_back(places[i]);
        }
        if (substeps > max_substeps) {
            done.beyond = again.size();
            break;
        }
        if (again.empty()) break;
        done.substeps = substeps;
        PointSet begun = begin.select(again);
        std::vector<std::uint32_t> finished;
        for (const std::uint32_t i : again)
            if (b[i] != gone) finished.push_back(b[i]);
        coarse = fine.select(finished);
        accept(begun, coarse, still);
        begin = std::move(begun);
        places = std::move(still);
    }
    points.keep(alive);
    return done;
}

}  // namespace rapid

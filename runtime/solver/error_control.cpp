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

SolveOptions with_substeps(SolveOptions options, int substeps)
{
    options.substeps = substeps;
    return options;
}

}  // namespace

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
        if (substeps <= max_substeps) {
            accept(begin, fine, places);
            done.substeps = substeps;
        }
        const std::vector<std::uint32_t> a = places_after(begin, coarse), b = places_after(begin, fine);
        const Strided<Vec3f> P = std::as_const(coarse).P().read(), Q = std::as_const(fine).P().read();
        std::vector<std::uint32_t> again, still, finished;  // places in this round's set, in `start`, in `fine`
        for (std::size_t i = 0; i < places.size(); ++i) {
            const bool both = a[i] != gone && b[i] != gone;
            if (both ? (P[a[i]].cast<double>() - Q[b[i]].cast<double>()).norm() <= tolerance : a[i] == b[i]) continue;
            again.push_back(static_cast<std::uint32_t>(i));
            still.push_back(places[i]);
            if (b[i] != gone) finished.push_back(b[i]);
        }
        if (2 * substeps > max_substeps) {
            done.beyond = again.size();
            break;
        }
        begin = begin.select(again);
        coarse = fine.select(finished);
        places = std::move(still);
    }
    points.keep(alive);
    return done;
}

}  // namespace rapid

#include "runtime/solver/estimate/error_control.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/solver/collision/stuck_columns.h"
#include "runtime/solver/estimate/step_doubling.h"

namespace rapid {
namespace {

// One call of solve_within().
class ToleranceSolver {
public:
    ToleranceSolver(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                    int max_substeps)
        : points_(points), dynamics_(dynamics), options_(options), limits_{tolerance,
                                                                           options.substeps,
                                                                           max_substeps,
                                                                           options.h,
                                                                           options.sinks.met,
                                                                           options.sinks.taken,
                                                                           !writes_more(dynamics)}
    {
        done_.substeps = options.substeps;
        if (StuckColumns::are_needed(dynamics)) StuckColumns::add_to(points);
    }

    FrameFigures run()
    {
        if (limits_.repeats)
            advance_blocks();
        else
            advance_copies();
        done_.died = dead_.size();
        if (!dead_.empty()) {
            std::vector<std::uint8_t> alive(points_.size(), 1);
            for (const std::uint32_t i : dead_) alive[i] = 0;
            points_.keep(alive);
        }
        if (auto* force = points_.find<Vec3f>("force")) force->fill(Vec3f::Zero());
        return done_;
    }

private:
    // Returns true if a run writes more than P and v of the points.
    static bool writes_more(const Dynamics& dynamics)
    {
        return !dynamics.actions().empty() || StuckColumns::are_needed(dynamics) ||
               std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(),
                           [](const auto& collider) { return collider->record.has_value(); });
    }

    // Runs the whole set first, then all unfinished points, and so on.
    void advance_blocks()
    {
        const std::span<Vec3f> P = points_.P().write(), v = points_.v().write();
        std::map<int, UnfinishedPoints> left;  // by the substeps of their next run
        const auto collect = [&](StepDoubling& run) {
            for (const auto& [substeps, rest] : run.unfinished()) left[substeps].append(rest);
            dead_.insert(dead_.end(), run.dead().begin(), run.dead().end());
        };
        StepDoubling all(limits_, options_.substeps, P, v, nullptr);
        solve_once(points_, options_.substeps, all);
        for (collect(all); !left.empty();) {
            const auto next = left.extract(left.begin());
            PointSet some = points_.select(next.mapped().indices);
            StepDoubling run(limits_, next.key(), P, v, &next.mapped());
            solve_once(some, next.key(), run);
            collect(run);
        }
    }

    // Runs on copies of a few thousand points, and keeps finished points from these. For runs that also write other
    // columns.
    void advance_copies()
    {
        constexpr std::size_t part_size = 2 * chunk_size;
        for (std::size_t begin = 0; begin < points_.size(); begin += part_size) {
            std::vector<std::uint32_t> indices(std::min(part_size, points_.size() - begin));
            std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(begin));
            PointSet start = points_.select(indices);
            Extrapolation extrapolation;
            extrapolation.reset(indices.size(), options_.h);
            for (int substeps = options_.substeps; !indices.empty(); substeps *= 2)
                advance_copy(start, indices, extrapolation, substeps);
        }
    }

    // Runs the points with these indices, stored in `start`. All three arguments then hold the points that need
    // another run.
    void advance_copy(PointSet& start, std::vector<std::uint32_t>& indices, Extrapolation& extrapolation, int substeps)
    {
        const std::size_t size = indices.size();
        UnfinishedPoints part;
        part.indices.resize(size);
        std::iota(part.indices.begin(), part.indices.end(), 0u);
        part.extrapolation = std::move(extrapolation);
        PointSet end = start;
        std::vector<std::uint8_t> met(options_.sinks.met ? size : 0);
        StepDoublingLimits limits = limits_;
        limits.met = options_.sinks.met ? met.data() : nullptr;
        std::vector<std::int32_t> taken(options_.sinks.taken ? size : 0);
        limits.taken = options_.sinks.taken ? taken.data() : nullptr;
        StepDoubling run(limits, substeps, end.P().write(), end.v().write(), &part);
        solve_once(end, substeps, run);

        UnfinishedPoints left;
        for (auto& [next, rest] : run.unfinished()) left = std::move(rest);  // all have the same next run
        std::vector<std::uint8_t> is_done(size, limits.may_be_result(substeps));
        if (!limits.is_result_of_all(substeps))
            for (const std::uint32_t i : left.indices) is_done[i] = 0;
        for (const std::uint32_t i : run.dead()) is_done[i] = 0, dead_.push_back(indices[i]);
        std::vector<std::uint32_t> from, to;
        for (std::uint32_t i = 0; i < size; ++i) {
            if (is_done[i]) from.push_back(i), to.push_back(indices[i]);
            if (options_.sinks.met && met[i]) options_.sinks.met[indices[i]] = 1;
            if (options_.sinks.taken && taken[i] > 0) options_.sinks.taken[indices[i]] = taken[i];
        }
        points_.put(to, end.select(from));

        if (left.indices.size() < size) start = start.select(left.indices);
        for (std::size_t k = 0; k < left.indices.size(); ++k) indices[k] = indices[left.indices[k]];
        indices.resize(left.indices.size());
        extrapolation = std::move(left.extrapolation);
    }

    void solve_once(PointSet& set, int substeps, StepDoubling& run)
    {
        SolveOptions options = options_;
        options.substeps = substeps;
        options.sinks = {};  // path kinds give that information
        const FrameFigures figures = solve(set, dynamics_, options, run);
        if (limits_.is_first(substeps))
            done_.add(figures);
        else  // contacts are counted once
            done_.penetration_max = std::max(done_.penetration_max, figures.penetration_max);
        done_.substeps = std::max(done_.substeps, run.largest_substeps());
        done_.beyond_tolerance += run.beyond_tolerance();
    }

    PointSet& points_;
    const Dynamics& dynamics_;
    const SolveOptions& options_;
    const StepDoublingLimits limits_;

    FrameFigures done_;
    std::vector<std::uint32_t> dead_;  // indices
};

}  // namespace

FrameFigures solve_within(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                          int max_substeps)
{
    return ToleranceSolver(points, dynamics, options, tolerance, max_substeps).run();
}

}  // namespace rapid

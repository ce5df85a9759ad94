#include "runtime/solver/error_control.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>

#include "runtime/parallel.h"
#include "runtime/solver/collide.h"

namespace rapid {
namespace {

constexpr std::uint32_t gone = UINT32_MAX;
constexpr double infinity = std::numeric_limits<double>::infinity();

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
    options.met = nullptr;  // the ways tell
    return options;
}

// Of each point that is solved again: what its runs so far come to.
class Series {
public:
    void reset(std::size_t size, double h)
    {
        h_ = h;
        runs_ = 0;
        length_.assign(size, 0);
        died_.assign(size, 0);
    }

    void begin_run()
    {
        const std::size_t column = std::min(runs_++, most_columns - 1);
        P_[column].resize(length_.size());
        v_[column].resize(length_.size());
    }

    // How far apart are, m, the last two runs, and the last two columns of the series: at the frame's end, or at that
    // of the next for being too fast.
    struct Difference {
        double run, best;
    };

    // What the run adds for point i, which dies in it or not: puts the best that is known now in place of the run's
    // end.
    Difference add(std::size_t i, Arrivals& run, bool dies)
    {
        Vec3d &P = run.P[i], &v = run.v[i];
        const bool lives = !dies && !died_[i], is_series = !dies && run.way[i] != Way::Broken;
        Difference off{infinity, infinity};
        if (lives && runs_ > 1)
            // Runs that find a contact at the same end of a sub-step agree on what is wrong with it.
            off.run = off.best = std::max(apart(P - P_[0][i], v - v_[0][i]), run.put_off[i]);
        else if (dies && died_[i])
            off = {0, 0};
        const std::size_t known = lives && is_series ? std::min<std::size_t>(length_[i], most_columns - 1) : 0;
        double power = 1;
        for (std::size_t c = 0; c < known; ++c) {
            power *= run.way[i] == Way::Acted ? 2 : 4;
            const Vec3d dP = P - P_[c][i], dv = v - v_[c][i];
            P_[c][i] = P;
            v_[c][i] = v;
            P += dP / (power - 1);
            v += dv / (power - 1);
            off.best = apart(dP, dv) / std::min(power - 1, most_trust);
        }
        P_[known][i] = P;
        v_[known][i] = v;
        length_[i] = static_cast<std::uint8_t>(is_series ? known + 1 : 0);
        died_[i] = dies;
        return off;
    }

    bool has_improved(std::size_t i) const { return length_[i] > 1; }

    // Only these points are solved again.
    void keep(std::span<const std::uint32_t> again)
    {
        const auto keep = [&](auto& list) {
            for (std::size_t k = 0; k < again.size(); ++k) list[k] = list[again[k]];
            list.resize(again.size());
        };
        keep(length_);
        keep(died_);
        for (std::size_t column = 0; column < std::min(runs_, most_columns); ++column) {
            keep(P_[column]);
            keep(v_[column]);
        }
    }

private:
    // What the difference of two columns is divided by, at most, to say how wrong the second is. The series itself has
    // 15, 63 and so on; but where steps are still too coarse for it, as in a close passage of an attractor, columns
    // that are 0.05 m apart may be wrong by 0.02 m: 3 keeps the promise there, and elsewhere columns come together so
    // fast that it costs nothing.
    static constexpr double most_trust = 3;
    static constexpr std::size_t most_columns = 6;  // what higher powers of the step add is rounding

    double apart(const Vec3d& dP, const Vec3d& dv) const { return std::max(dP.norm(), h_ * dv.norm()); }

    double h_ = 0;  // s, of the frame
    std::size_t runs_ = 0;
    std::vector<std::uint8_t> length_;  // how many columns the next run can go on from
    std::vector<std::uint8_t> died_;    // in the last run
    std::array<std::vector<Vec3d>, most_columns> P_, v_;
};

// Of a large set its memory is worth keeping from frame to frame: to have it anew takes as long as to solve.
struct Workspace {
    Series series;
    Arrivals run;

    // Of each point that is solved again.
    std::vector<double> off;
    std::vector<Vec3f> best;
    std::vector<std::uint8_t> finished, improved;
};

}  // namespace

Tolerated solve_within(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options,
                       double tolerance, int max_substeps)
{
    Tolerated done;
    done.substeps = options.substeps;
    PointSet begin = points;                           // of those that are not done
    std::vector<std::uint32_t> places(points.size());  // theirs in `points`
    std::iota(places.begin(), places.end(), 0u);
    std::vector<std::uint8_t> alive(points.size(), 1);
    thread_local Workspace kept;
    auto& [series, run, off, best, finished, improved] = kept;  // this thread's, for all that work on it
    series.reset(points.size(), options.h);

    bool first = true, last = false;
    for (int substeps = options.substeps; !places.empty() && !last; substeps *= 2, first = false) {
        const std::size_t size = places.size();
        PointSet end = begin;
        const SolveResult result = solve(end, dynamics, with_substeps(options, substeps), &run);
        if (first) done.result = result;
        done.result.penetration_max = std::max(done.result.penetration_max, result.penetration_max);
        // One run tells nothing: there is a second even where that would be beyond the limit, but for its error alone.
        const bool counts = first || substeps <= max_substeps, takes_all = counts && substeps > max_substeps / 2;
        last = !first && substeps > max_substeps / 2;

        const std::vector<std::uint32_t> after = places_after(begin, end);
        series.begin_run();
        off.assign(size, 0);
        best.resize(size);
        finished.resize(size);
        improved.assign(size, 0);
        for_each_chunk(size, [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) {
                finished[i] = run.way[i] == Way::Exact;
                if (options.met && run.way[i] == Way::Broken) options.met[places[i]] = 1;
                if (finished[i]) continue;
                const Series::Difference difference = series.add(i, run, after[i] == gone);
                off[i] = difference.run;
                best[i] = run.P[i].cast<float>();
                finished[i] = !first && (counts ? difference.best : difference.run) <= tolerance;
                improved[i] = counts && (finished[i] || takes_all) && series.has_improved(i);
            }
        });
        keep_outside(dynamics, begin, best, improved);

        std::vector<std::uint32_t> again, still, from, to;
        const std::span<Vec3f> P = end.P().write(), v = end.v().write();
        for (std::size_t i = 0; i < size; ++i) {
            const auto place = static_cast<std::uint32_t>(i);
            if (improved[i]) {
                P[after[i]] = best[i];
                v[after[i]] = run.v[i].cast<float>();
            } else if (finished[i]) {
                finished[i] = off[i] <= tolerance;
            }
            if (counts && (finished[i] || takes_all)) {
                alive[places[i]] = after[i] != gone;
                if (after[i] != gone) from.push_back(after[i]), to.push_back(places[i]);
            }
            if (!finished[i]) again.push_back(place), still.push_back(places[i]);
        }
        if (counts) done.substeps = substeps;
        if (last) done.beyond = again.size();
        if (from.size() == points.size())
            points = std::move(end);
        else
            points.put(to, from.size() == end.size() ? end : end.select(from));

        places = std::move(still);
        if (again.size() == size) continue;
        begin = begin.select(again);
        series.keep(again);
    }
    if (std::find(alive.begin(), alive.end(), 0) != alive.end()) points.keep(alive);
    return done;
}

}  // namespace rapid

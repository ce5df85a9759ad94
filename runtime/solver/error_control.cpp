#include "runtime/solver/error_control.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
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

// Of each of some points: what its runs so far come to.
class Series {
public:
    // Of points that have not run. h: the frame's length, s.
    void reset(std::size_t size, double h)
    {
        h_ = h;
        runs_ = 0;
        length_.assign(size, 0);
        died_.assign(size, 0);
    }

    // Those of `from` from `begin` on.
    void assign(const Series& from, std::size_t begin, std::size_t size)
    {
        h_ = from.h_;
        runs_ = from.runs_;
        each(*this, from,
             [&](auto& list, const auto& other) { list.assign(other.begin() + begin, other.begin() + begin + size); });
    }

    // Points that have as many runs.
    void append(const Series& from)
    {
        h_ = from.h_;
        runs_ = from.runs_;
        each(*this, from, [](auto& list, const auto& other) { list.insert(list.end(), other.begin(), other.end()); });
    }

    // Takes the ends of a run, which then has those of the run before.
    void begin_run(Arrivals& run)
    {
        const std::size_t column = std::min(runs_++, most_columns - 1);
        P_[column].resize(length_.size());
        v_[column].resize(length_.size());
        P_[0].swap(run.P);
        v_[0].swap(run.v);
        run.P.resize(length_.size());
        run.v.resize(length_.size());
    }

    // How far apart are, m, the last two runs, and the last two columns of the series: at the frame's end, or at that
    // of the next for being too fast.
    struct Difference {
        double run, best;
    };

    // What the run adds for point i, which dies in it or not: puts the best that is known now into `run`, where that is
    // more than the run itself.
    Difference add(std::size_t i, Arrivals& run, bool dies)
    {
        const bool lives = !dies && !died_[i], is_series = !dies && run.way[i] != Way::Broken;
        const std::size_t known = lives && is_series ? std::min<std::size_t>(length_[i], most_columns - 1) : 0;
        const bool is_second = lives && runs_ > 1, stays_dead = dies && died_[i];
        died_[i] = dies;
        length_[i] = static_cast<std::uint8_t>(is_series ? known + 1 : 0);
        if (!is_second) return stays_dead ? Difference{0, 0} : Difference{infinity, infinity};

        Vec3d P = P_[0][i], v = v_[0][i];
        Vec3d dP = P - run.P[i], dv = v - run.v[i];
        // Runs that find a contact at the same end of a sub-step agree on what is wrong with it.
        Difference off;
        off.run = off.best = std::max(apart(dP, dv), run.put_off[i]);
        if (known == 0) return off;
        const double order = run.way[i] == Way::Acted ? 2 : 4;
        double power = order;
        for (std::size_t c = 1;; ++c, power *= order) {
            P += dP / (power - 1);
            v += dv / (power - 1);
            if (c == known) break;
            dP = P - P_[c][i];
            dv = v - v_[c][i];
            P_[c][i] = P;
            v_[c][i] = v;
        }
        off.best = apart(dP, dv) / std::min(power - 1, most_trust);
        run.P[i] = P;
        run.v[i] = v;
        return off;
    }

    bool has_improved(std::size_t i) const { return length_[i] > 1; }

    // After a run: leaves only these points, whose best is the last column.
    void keep(std::span<const std::uint32_t> places, const Arrivals& run)
    {
        for (const std::uint32_t i : places) {
            if (!has_improved(i)) continue;
            P_[length_[i] - 1][i] = run.P[i];
            v_[length_[i] - 1][i] = run.v[i];
        }
        if (places.size() == length_.size()) return;
        each(*this, *this, [&](auto& list, const auto&) {
            for (std::size_t k = 0; k < places.size(); ++k) list[k] = list[places[k]];
            list.resize(places.size());
        });
    }

private:
    // What the difference of two columns is divided by, at most, to say how wrong the second is. The series itself has
    // 15, 63 and so on; but where steps are still too coarse for it, as in a close passage of an attractor, columns
    // that are 0.05 m apart may be wrong by 0.02 m: 3 keeps the promise there, and elsewhere columns come together so
    // fast that it costs nothing.
    static constexpr double most_trust = 3;
    static constexpr std::size_t most_columns = 6;  // what higher powers of the step add is rounding

    // All lists that have an entry a point.
    template <class F>
    static void each(Series& series, const Series& other, const F& f)
    {
        f(series.length_, other.length_);
        f(series.died_, other.died_);
        for (std::size_t column = 0; column < std::min(other.runs_, most_columns); ++column) {
            f(series.P_[column], other.P_[column]);
            f(series.v_[column], other.v_[column]);
        }
    }

    double apart(const Vec3d& dP, const Vec3d& dv) const
    {
        return std::sqrt(std::max(dP.squaredNorm(), h_ * h_ * dv.squaredNorm()));
    }

    double h_ = 0;  // s, of the frame
    std::size_t runs_ = 0;
    std::vector<std::uint8_t> length_;  // how many columns the next run can go on from
    std::vector<std::uint8_t> died_;    // in the last run
    std::array<std::vector<Vec3d>, most_columns> P_, v_;
};

// Of a point after a run.
enum class Verdict : std::uint8_t { Again, WithinIfImproved, Within };

// Points that are solved together: all of their runs are in cache.
struct Part {
    PointSet begin;                     // as they were before the step
    std::vector<std::uint32_t> places;  // of these in the set
    Series series;
    Arrivals run;

    // Of each, after the run.
    std::vector<std::uint32_t> after;  // its place in the set that the run has left; empty: the same
    std::vector<Verdict> verdict;
    std::vector<std::uint8_t> improved;  // whether the series' best is the result
    std::vector<Vec3f> best;             // of these where it is

    std::uint32_t place_after(std::size_t i) const { return after.empty() ? static_cast<std::uint32_t>(i) : after[i]; }
};

// What has become of a part.
struct Outcome {
    SolveResult result;                     // of the first run
    int substeps = 0;                       // the most
    std::uint64_t beyond = 0;               // points that are not within the tolerance
    std::vector<std::uint32_t> dead, left;  // places in the set
    Series series;                          // of those that are left
    std::exception_ptr error;
};

class SolveWithin {
public:
    SolveWithin(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options, double tolerance,
                int max_substeps)
        : points_(points),
          dynamics_(dynamics),
          options_(options),
          tolerance_(tolerance),
          max_substeps_(max_substeps),
          collides_(std::any_of(dynamics.begin(), dynamics.end(), is_collider)),
          writes_any_(std::any_of(dynamics.begin(), dynamics.end(), writes_any)),
          P_(points.P().write()),
          v_(points.v().write())
    {
    }

    Tolerated run()
    {
        done_.substeps = options_.substeps;
        advance_all(points_.size(), options_.substeps, [&](Part& part, std::size_t begin, std::size_t size) {
            part.places.resize(size);
            std::iota(part.places.begin(), part.places.end(), static_cast<std::uint32_t>(begin));
            part.series.reset(size, options_.h);
        });
        for (int substeps = options_.substeps; !left_.empty();) {
            substeps *= 1 << runs_a_pass;
            const std::vector<std::uint32_t> left = std::exchange(left_, {});
            const Series series = std::exchange(series_, {});
            advance_all(left.size(), substeps, [&](Part& part, std::size_t begin, std::size_t size) {
                part.places.assign(left.begin() + begin, left.begin() + begin + size);
                part.series.assign(series, begin, size);
            });
        }
        if (!dead_.empty()) {
            std::vector<std::uint8_t> alive(points_.size(), 1);
            for (const std::uint32_t place : dead_) alive[place] = 0;
            points_.keep(alive);
        }
        if (auto* force = points_.find<Vec3f>("force")) force->fill(Vec3f::Zero());
        return done_;
    }

private:
    // Those that need more are few, or they need so many that to begin anew with them costs nothing: they are gathered
    // from all parts.
    static constexpr int runs_a_pass = 2;

    static bool is_collider(const DynamicPtr& dynamic)
    {
        return dynamic_cast<const Collider*>(dynamic.get()) != nullptr;
    }

    // Whether it may change more of points than their P and v.
    static bool writes_any(const DynamicPtr& dynamic)
    {
        const auto* collider = dynamic_cast<const Collider*>(dynamic.get());
        return dynamic_cast<const Action*>(dynamic.get()) || (collider && collider->record);
    }

    struct Turn {
        bool first;      // it is the first run
        bool counts;     // points may have its result
        bool takes_all;  // all points that are left have it
    };

    // Takes n points through the runs of a pass, part by part: those that `begin` gives.
    template <class F>
    void advance_all(std::size_t n, int substeps, const F& begin_part)
    {
        // Where more is written than P and v, by actions that begin on one thread, it is written part by part.
        const std::size_t size = writes_any_ ? 16 * chunk_size : chunk_size;
        std::vector<Outcome> outcomes((n + size - 1) / size);
        tbb::enumerable_thread_specific<Part> parts;
        const auto advance = [&](std::size_t begin, std::size_t end) {
            Outcome& outcome = outcomes[begin / size];
            try {
                Part& part = parts.local();
                begin_part(part, begin, end - begin);
                part.begin = points_.select(part.places);
                advance_part(part, substeps, outcome);
            } catch (...) {
                outcome.error = std::current_exception();
            }
        };
        if (writes_any_)
            for (std::size_t begin = 0; begin < n; begin += size) advance(begin, std::min(n, begin + size));
        else
            for_each_chunk(
                n,
                [&](std::size_t begin, std::size_t end) {
                    // What a thread waits for within a part is not another one, whose memory would be the same.
                    tbb::this_task_arena::isolate([&] { advance(begin, end); });
                },
                size);
        for (const Outcome& outcome : outcomes) take(outcome);
    }

    void take(const Outcome& outcome)
    {
        if (outcome.error) std::rethrow_exception(outcome.error);
        SolveResult& all = done_.result;
        const SolveResult& result = outcome.result;
        all.collisions += result.collisions;
        all.contact_limit += result.contact_limit;
        all.trapped += result.trapped;
        all.contact_energy += result.contact_energy;
        all.penetration_max = std::max(all.penetration_max, result.penetration_max);
        all.died += outcome.dead.size();
        done_.substeps = std::max(done_.substeps, outcome.substeps);
        done_.beyond += outcome.beyond;
        dead_.insert(dead_.end(), outcome.dead.begin(), outcome.dead.end());
        left_.insert(left_.end(), outcome.left.begin(), outcome.left.end());
        if (!outcome.left.empty()) series_.append(outcome.series);
    }

    void advance_part(Part& part, int substeps, Outcome& outcome)
    {
        bool last = false;
        for (int run = 0; run < runs_a_pass && !part.places.empty() && !last; ++run, substeps *= 2)
            last = advance_once(part, substeps, outcome);
        if (last) return;
        outcome.left = part.places;
        outcome.series = part.series;
    }

    // A run. Leaves in `part` those that need another; true: there is none.
    bool advance_once(Part& part, int substeps, Outcome& outcome)
    {
        const std::size_t size = part.places.size();
        const bool first = substeps == options_.substeps;
        // One run tells nothing: there is a second even where that would be beyond the limit, but for its error alone.
        const bool counts = first || substeps <= max_substeps_, takes_all = counts && substeps > max_substeps_ / 2;
        const bool last = !first && substeps > max_substeps_ / 2;
        const Turn turn{first, counts, takes_all};

        PointSet end = part.begin;
        SolveOptions now = options_;
        now.substeps = substeps;
        now.met = nullptr;  // the ways tell
        const SolveResult result = solve(end, dynamics_, now, &part.run);
        if (first) outcome.result = result;
        outcome.result.penetration_max = std::max(outcome.result.penetration_max, result.penetration_max);

        part.after.clear();
        if (end.size() < size) part.after = places_after(part.begin, end);
        if (counts) outcome.substeps = substeps;
        judge(part, turn);
        if (first && !takes_all && std::all_of(part.verdict.begin(), part.verdict.end(), [](Verdict verdict) {
                return verdict == Verdict::Again;
            }))
            return false;
        if (collides_ && !first) {
            part.best.resize(size);
            cast(std::span<const Vec3d>(part.run.P), part.best);
            keep_outside(dynamics_, part.begin, part.best, part.improved);
        }

        const std::vector<std::uint32_t> again = take_final(part, end, turn, outcome);
        if (last) outcome.beyond = again.size();
        if (last) return true;
        part.series.keep(again, part.run);
        if (again.size() == size) return false;
        part.begin = part.begin.select(again);
        for (std::size_t k = 0; k < again.size(); ++k) part.places[k] = part.places[again[k]];
        part.places.resize(again.size());
        return false;
    }

    // What is to become of each point after its run.
    void judge(Part& part, const Turn& turn) const
    {
        const std::size_t size = part.places.size();
        part.series.begin_run(part.run);
        part.verdict.resize(size);
        part.improved.resize(size);
        for_each_chunk(size, [&](std::size_t from, std::size_t to) {
            const std::span<Verdict> verdict = part.verdict;
            const std::span<std::uint8_t> improved = part.improved;
            const std::span<const Way> way = part.run.way;
            for (std::size_t i = from; i < to; ++i) {
                improved[i] = 0;
                verdict[i] = Verdict::Within;
                if (way[i] == Way::Exact) continue;
                if (options_.met && way[i] == Way::Broken) options_.met[part.places[i]] = 1;
                const Series::Difference off = part.series.add(i, part.run, part.place_after(i) == gone);
                const bool within = !turn.first && (turn.counts ? off.best : off.run) <= tolerance_;
                verdict[i] = !within                 ? Verdict::Again
                             : off.run <= tolerance_ ? Verdict::Within
                                                     : Verdict::WithinIfImproved;
                improved[i] = turn.counts && (within || turn.takes_all) && part.series.has_improved(i);
            }
        });
    }

    // Writes those that have come to their end; returns the places in the part of those that have not.
    std::vector<std::uint32_t> take_final(Part& part, PointSet& end, const Turn& turn, Outcome& outcome) const
    {
        std::vector<std::uint32_t> again, from, to;
        const std::span<const Verdict> verdict = part.verdict;
        const std::span<Vec3f> P = end.P().write(), v = end.v().write();
        for (std::size_t i = 0; i < verdict.size(); ++i) {
            const bool improved = part.improved[i];
            const bool within = verdict[i] == Verdict::Within || (improved && verdict[i] == Verdict::WithinIfImproved);
            if (!within) again.push_back(static_cast<std::uint32_t>(i));
            if (!turn.counts || !(within || turn.takes_all)) continue;
            const std::uint32_t after = part.place_after(i), place = part.places[i];
            if (after == gone) {
                outcome.dead.push_back(place);
                continue;
            }
            if (improved) {
                P[after] = part.run.P[i].cast<float>();
                v[after] = part.run.v[i].cast<float>();
            }
            if (writes_any_) {
                from.push_back(after);
                to.push_back(place);
            } else {
                P_[place] = P[after];
                v_[place] = v[after];
            }
        }
        if (writes_any_) points_.put(to, end.select(from));
        return again;
    }

    PointSet& points_;
    const std::span<const DynamicPtr> dynamics_;
    const SolveOptions& options_;
    const double tolerance_;
    const int max_substeps_;
    const bool collides_, writes_any_;
    const std::span<Vec3f> P_, v_;

    Tolerated done_;
    std::vector<std::uint32_t> dead_, left_;  // places in the set: of the points that have died, and that need more
    Series series_;                           // of those that need more
};

}  // namespace

Tolerated solve_within(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options,
                       double tolerance, int max_substeps)
{
    return SolveWithin(points, dynamics, options, tolerance, max_substeps).run();
}

}  // namespace rapid

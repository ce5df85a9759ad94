#include "runtime/solver/estimate/error_control.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>

#include "runtime/parallel.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/refinement.h"

namespace rapid {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double squared(double x) { return x * x; }

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

    // Of these of `from`.
    void select(const Series& from, std::span<const std::uint32_t> places)
    {
        reset(0, from.h_);
        for (std::size_t column = 0; column < most_columns; ++column) {
            P_[column].clear();
            v_[column].clear();
        }
        append(from, places);
    }

    // And of these, which have as many runs.
    void append(const Series& from, std::span<const std::uint32_t> places)
    {
        h_ = from.h_;
        runs_ = from.runs_;
        const auto add = [&](auto& list, const auto& other) {
            const std::size_t begin = list.size();
            list.resize(begin + places.size());
            for (std::size_t k = 0; k < places.size(); ++k) list[begin + k] = other[places[k]];
        };
        add(length_, from.length_);
        add(died_, from.died_);
        for (std::size_t column = 0; column < std::min(runs_, most_columns); ++column) {
            add(P_[column], from.P_[column]);
            add(v_[column], from.v_[column]);
        }
    }

    void begin_run()
    {
        const std::size_t column = std::min(runs_++, most_columns - 1);
        P_[column].resize(length_.size());
        v_[column].resize(length_.size());
    }

    // How far apart are the last two runs, and the last two columns of the series: at the frame's end, or at that of
    // the next for being too fast. Squared, m².
    struct Difference {
        double run, best;
    };

    // What the run adds for point i; P and v: the best that is known of it now.
    Difference add(std::size_t i, const BlockResult& end, Vec3d& P, Vec3d& v)
    {
        P = end.P[i];
        v = end.v[i];
        const bool dies = !end.dead.empty() && end.dead[i];
        const bool lives = !dies && !died_[i], is_series = !dies && end.path[i] != PathKind::Broken;
        Difference off{infinity, infinity};
        if (lives && runs_ > 1)
            // Runs that find a contact at the same end of a sub-step agree on what is wrong with it.
            off.run = off.best = std::max(apart2(P - P_[0][i], v - v_[0][i]), squared(end.put_off[i]));
        else if (dies && died_[i])
            off = {0, 0};
        const std::size_t known = lives && is_series ? std::min<std::size_t>(length_[i], most_columns - 1) : 0;
        double power = 1;
        for (std::size_t c = 0; c < known; ++c) {
            power *= end.path[i] == PathKind::Acted ? 2 : 4;
            const Vec3d dP = P - P_[c][i], dv = v - v_[c][i];
            P_[c][i] = P;
            v_[c][i] = v;
            P += dP / (power - 1);
            v += dv / (power - 1);
            off.best = apart2(dP, dv) / squared(std::min(power - 1, most_trust));
        }
        P_[known][i] = P;
        v_[known][i] = v;
        length_[i] = static_cast<std::uint8_t>(is_series ? known + 1 : 0);
        died_[i] = dies;
        return off;
    }

    bool has_improved(std::size_t i) const { return length_[i] > 1; }

private:
    // What the difference of two columns is divided by, at most, to say how wrong the second is. The series itself has
    // 15, 63 and so on; but where steps are still too coarse for it, as in a close passage of an attractor, columns
    // that are 0.05 m apart may be wrong by 0.02 m: 3 keeps the promise there, and elsewhere columns come together so
    // fast that it costs nothing.
    static constexpr double most_trust = 3;
    static constexpr std::size_t most_columns = 6;  // what higher powers of the step add is rounding

    double apart2(const Vec3d& dP, const Vec3d& dv) const
    {
        return std::max(dP.squaredNorm(), squared(h_) * dv.squaredNorm());
    }

    double h_ = 0;  // s, of the frame
    std::size_t runs_ = 0;
    std::vector<std::uint8_t> length_;  // how many columns the next run can go on from
    std::vector<std::uint8_t> died_;    // in the last run
    std::array<std::vector<Vec3d>, most_columns> P_, v_;
};

// What is asked for, and what a run of so many sub-steps is by that.
struct Asked {
    double tolerance;    // m
    int first_substeps;  // of the first run of a point
    int max_substeps;
    double h;           // s, the frame's length
    std::uint8_t* met;  // by place; may be null
    bool repeats;       // a block may go through the frame as often as it needs to

    // One run tells nothing: there is a second even where that would be beyond the limit, but for its error alone.
    bool is_first(int substeps) const { return substeps == first_substeps; }
    bool counts(int substeps) const { return is_first(substeps) || substeps <= max_substeps; }
    bool takes_all(int substeps) const { return counts(substeps) && substeps > max_substeps / 2; }
    bool is_last(int substeps) const { return !is_first(substeps) && substeps > max_substeps / 2; }
};

// Points that need more runs, all as many so far.
struct Rest {
    std::vector<std::uint32_t> places;
    Series series;

    void append(const Rest& other)
    {
        std::vector<std::uint32_t> all(other.places.size());
        std::iota(all.begin(), all.end(), 0u);
        series.append(other.series, all);
        places.insert(places.end(), other.places.begin(), other.places.end());
    }
};

// One pass over a set, or over the rest of one.
class Pass final : public Refinement {
public:
    // substeps: of the next run. P and v: of all points, to write results to. rest: those that are solved, as a set of
    // their own, and their runs so far; null: all, from the first run on.
    Pass(const Asked& asked, int substeps, std::span<Vec3f> P, std::span<Vec3f> v, const Rest* rest)
        : asked_(asked), substeps_(substeps), P_(P), v_(v), rest_(rest)
    {
    }

    bool takes_exact() const override { return asked_.is_first(substeps_); }
    std::unique_ptr<BlockRefinement> begin() override;

    // Afterwards: those that need more, by the sub-steps of their next run; those that have died.
    std::map<int, Rest> left()
    {
        std::sort(left_.begin(), left_.end(),
                  [](const auto& a, const auto& b) { return a.second.places.front() < b.second.places.front(); });
        std::map<int, Rest> all;
        for (const auto& [substeps, some] : left_) all[substeps].append(some);
        return all;
    }
    std::span<const std::uint32_t> dead() const { return dead_; }

    int most_substeps() const { return most_substeps_; }
    std::uint64_t beyond() const { return beyond_; }

private:
    class Block;

    std::uint32_t place_of(std::uint32_t solved) const { return rest_ ? rest_->places[solved] : solved; }

    const Asked& asked_;
    const int substeps_;
    const std::span<Vec3f> P_, v_;
    const Rest* const rest_;

    std::mutex mutex_;
    std::vector<std::pair<int, Rest>> left_;
    std::vector<std::uint32_t> dead_;
    int most_substeps_ = 0;
    std::uint64_t beyond_ = 0;
};

class Pass::Block final : public BlockRefinement {
public:
    explicit Block(Pass& pass) : pass_(pass), asked_(pass.asked_) {}

    void begin(std::span<const std::uint32_t> places) override
    {
        const std::size_t size = places.size();
        substeps_ = pass_.substeps_;
        places_.resize(size);
        for (std::size_t i = 0; i < size; ++i) places_[i] = pass_.place_of(places[i]);
        if (pass_.rest_)
            series_.select(pass_.rest_->series, places);
        else
            series_.reset(size, asked_.h);
        open_.resize(size);
        std::iota(open_.begin(), open_.end(), 0u);
        fate_.assign(size, Fate::Open);
        best_P_.resize(size);
        best_v_.resize(size);
        P_.resize(size);
        v_.resize(size);
    }

    int take(const BlockResult& end) override
    {
        judge(end);
        settle(end);
        const int substeps = substeps_;
        substeps_ *= 2;
        if (!open_.empty() && !asked_.is_last(substeps)) {
            // That some go once more in vain costs less than to gather the others.
            const bool are_most = 4 * open_.size() >= 3 * places_.size();
            if (asked_.repeats && (are_most || asked_.takes_all(substeps))) return substeps_;
        }
        write(substeps);
        return 0;
    }

private:
    enum class Verdict : std::uint8_t { Again, WithinIfImproved, Within };
    enum class Fate : std::uint8_t { Open, Known, Dead };

    // How wrong the points that are open are.
    void judge(const BlockResult& end)
    {
        const bool first = asked_.is_first(substeps_), counts = asked_.counts(substeps_);
        const double allowed = squared(asked_.tolerance);
        series_.begin_run();
        verdict_.assign(places_.size(), Verdict::Within);
        improved_.assign(places_.size(), 0);
        for (const std::uint32_t i : open_) {
            if (end.path[i] == PathKind::Exact) continue;
            if (asked_.met && end.path[i] == PathKind::Broken) asked_.met[places_[i]] = 1;
            const Series::Difference off = series_.add(i, end, best_P_[i], best_v_[i]);
            const bool within = !first && (counts ? off.best : off.run) <= allowed;
            verdict_[i] = !within ? Verdict::Again : off.run <= allowed ? Verdict::Within : Verdict::WithinIfImproved;
            improved_[i] = counts && (within || asked_.takes_all(substeps_)) && series_.has_improved(i);
        }
        if (!first) keep_outside(end.obstacles, end.places, best_P_, improved_);
    }

    // What of that is their result. Leaves open those that need another run.
    void settle(const BlockResult& end)
    {
        const bool counts = asked_.counts(substeps_), takes_all = asked_.takes_all(substeps_);
        std::size_t open = 0;
        for (const std::uint32_t i : open_) {
            const bool within =
                verdict_[i] == Verdict::Within || (improved_[i] && verdict_[i] == Verdict::WithinIfImproved);
            if (counts && (within || takes_all)) {
                P_[i] = improved_[i] ? best_P_[i].cast<float>() : end.rounded[i];
                v_[i] = (improved_[i] ? best_v_[i] : end.v[i]).cast<float>();
                fate_[i] = !end.dead.empty() && end.dead[i] ? Fate::Dead : Fate::Known;
            }
            if (!within) open_[open++] = i;
        }
        open_.resize(open);
    }

    // The block is over, with a run of so many sub-steps.
    void write(int substeps)
    {
        for (std::size_t i = 0; i < places_.size(); ++i) {
            if (fate_[i] != Fate::Known) continue;
            pass_.P_[places_[i]] = P_[i];
            pass_.v_[places_[i]] = v_[i];
        }
        const std::scoped_lock lock(pass_.mutex_);
        for (std::size_t i = 0; i < places_.size(); ++i)
            if (fate_[i] == Fate::Dead) pass_.dead_.push_back(places_[i]);
        pass_.most_substeps_ = std::max(pass_.most_substeps_, asked_.counts(substeps) ? substeps : substeps / 2);
        if (asked_.is_last(substeps)) {
            pass_.beyond_ += open_.size();
        } else if (!open_.empty()) {
            Rest rest;
            rest.series.select(series_, open_);
            for (const std::uint32_t i : open_) rest.places.push_back(places_[i]);
            pass_.left_.emplace_back(2 * substeps, std::move(rest));
        }
    }

    Pass& pass_;
    const Asked& asked_;

    int substeps_ = 1;                   // of the run
    std::vector<std::uint32_t> places_;  // in the set
    Series series_;
    std::vector<std::uint32_t> open_;  // places in the block of those that have no result yet that is good enough
    std::vector<Verdict> verdict_;
    std::vector<std::uint8_t> improved_;  // whether the series' best is the result
    std::vector<Vec3d> best_P_, best_v_;  // that
    std::vector<Fate> fate_;
    std::vector<Vec3f> P_, v_;  // where it is known
};

std::unique_ptr<BlockRefinement> Pass::begin() { return std::make_unique<Block>(*this); }

// What solve_within() does, in one call of it.
class SolveWithin {
public:
    SolveWithin(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                int max_substeps)
        : points_(points), dynamics_(dynamics), options_(options), asked_{tolerance,    options.substeps,
                                                                          max_substeps, options.h,
                                                                          options.met,  !writes_more(dynamics)}
    {
        done_.substeps = options.substeps;
    }

    Tolerated run()
    {
        if (asked_.repeats)
            advance_blocks();
        else
            advance_copies();
        done_.result.died = dead_.size();
        if (!dead_.empty()) {
            std::vector<std::uint8_t> alive(points_.size(), 1);
            for (const std::uint32_t place : dead_) alive[place] = 0;
            points_.keep(alive);
        }
        if (auto* force = points_.find<Vec3f>("force")) force->fill(Vec3f::Zero());
        return done_;
    }

private:
    // Whether they write more of the points than P and v.
    static bool writes_more(const Dynamics& dynamics)
    {
        return !dynamics.actions().empty() ||
               std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(),
                           [](const auto& collider) { return collider->record.has_value(); });
    }

    // All of the set at once, then all that is left of it, and so on.
    void advance_blocks()
    {
        const std::span<Vec3f> P = points_.P().write(), v = points_.v().write();
        std::map<int, Rest> left;  // by the sub-steps of their next run
        const auto take = [&](Pass& pass) {
            for (const auto& [substeps, rest] : pass.left()) left[substeps].append(rest);
            dead_.insert(dead_.end(), pass.dead().begin(), pass.dead().end());
        };
        Pass all(asked_, options_.substeps, P, v, nullptr);
        solve_once(points_, options_.substeps, all);
        for (take(all); !left.empty();) {
            const auto next = left.extract(left.begin());
            PointSet some = points_.select(next.mapped().places);
            Pass pass(asked_, next.key(), P, v, &next.mapped());
            solve_once(some, next.key(), pass);
            take(pass);
        }
    }

    // Where a run writes other columns, too: on copies of a few thousand points, of which those that are done are kept.
    void advance_copies()
    {
        constexpr std::size_t part_size = 2 * chunk_size;
        for (std::size_t begin = 0; begin < points_.size(); begin += part_size) {
            std::vector<std::uint32_t> places(std::min(part_size, points_.size() - begin));
            std::iota(places.begin(), places.end(), static_cast<std::uint32_t>(begin));
            PointSet start = points_.select(places);
            Series series;
            series.reset(places.size(), options_.h);
            for (int substeps = options_.substeps; !places.empty(); substeps *= 2)
                advance_copy(start, places, series, substeps);
        }
    }

    // A run of the points at these places, which are `start`. Leaves in all three those that need another.
    void advance_copy(PointSet& start, std::vector<std::uint32_t>& places, Series& series, int substeps)
    {
        const std::size_t size = places.size();
        Rest part;
        part.places.resize(size);
        std::iota(part.places.begin(), part.places.end(), 0u);
        part.series = std::move(series);
        PointSet end = start;
        std::vector<std::uint8_t> met(options_.met ? size : 0);
        Asked asked = asked_;
        asked.met = options_.met ? met.data() : nullptr;
        Pass pass(asked, substeps, end.P().write(), end.v().write(), &part);
        solve_once(end, substeps, pass);

        Rest left;
        for (auto& [next, rest] : pass.left()) left = std::move(rest);  // all at the same next run
        std::vector<std::uint8_t> is_done(size, asked.counts(substeps));
        if (!asked.takes_all(substeps))
            for (const std::uint32_t i : left.places) is_done[i] = 0;
        for (const std::uint32_t i : pass.dead()) is_done[i] = 0, dead_.push_back(places[i]);
        std::vector<std::uint32_t> from, to;
        for (std::uint32_t i = 0; i < size; ++i) {
            if (is_done[i]) from.push_back(i), to.push_back(places[i]);
            if (options_.met && met[i]) options_.met[places[i]] = 1;
        }
        points_.put(to, end.select(from));

        if (left.places.size() < size) start = start.select(left.places);
        for (std::size_t k = 0; k < left.places.size(); ++k) places[k] = places[left.places[k]];
        places.resize(left.places.size());
        series = std::move(left.series);
    }

    void solve_once(PointSet& set, int substeps, Pass& pass)
    {
        SolveOptions options = options_;
        options.substeps = substeps;
        options.met = nullptr;  // the kinds of path tell
        const SolveResult result = solve(set, dynamics_, options, pass);
        SolveResult& all = done_.result;
        all.penetration_max = std::max(all.penetration_max, result.penetration_max);
        done_.substeps = std::max(done_.substeps, pass.most_substeps());
        done_.beyond += pass.beyond();
        if (!asked_.is_first(substeps)) return;
        all.collisions += result.collisions;
        all.contact_limit += result.contact_limit;
        all.trapped += result.trapped;
        all.contact_energy += result.contact_energy;
    }

    PointSet& points_;
    const Dynamics& dynamics_;
    const SolveOptions& options_;
    const Asked asked_;

    Tolerated done_;
    std::vector<std::uint32_t> dead_;  // places
};

}  // namespace

Tolerated solve_within(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                       int max_substeps)
{
    return SolveWithin(points, dynamics, options, tolerance, max_substeps).run();
}

}  // namespace rapid

#include "runtime/solver/estimate/error_control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/points/id_index.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/solve.h"

namespace rapid {

// Step doubling: runs of points through a frame with n, 2n, 4n, ... substeps, until each point's result is good enough
// (error_control.h). The runs of a block are taken while it is in cache.

// Richardson extrapolation of the runs of points through a frame, each with twice as many substeps as the previous one
// (Romberg 1955).
//
// The error of a run is a series in powers of the step: even powers with forces alone, all powers from the first on
// with actions. Each further run eliminates one more power. A path with a contact has no such series; its columns
// restart.
//
// Layout: column c of the table holds, for each point, the latest extrapolation from c + 1 runs; shape [points].
class Extrapolation {
public:
    // Begins with no runs. h: frame length, s.
    void reset(std::size_t size, double h)
    {
        h_ = h;
        runs_ = 0;
        length_.assign(size, 0);
        died_.assign(size, 0);
    }

    // Becomes the extrapolation of the points `chosen` of `from`.
    void select(const Extrapolation& from, std::span<const std::uint32_t> chosen)
    {
        reset(0, from.h_);
        for (std::size_t column = 0; column < max_columns; ++column) {
            P_[column].clear();
            v_[column].clear();
        }
        append(from, chosen);
    }

    // Adds the points `chosen` of `from`, which has the same number of runs.
    void append(const Extrapolation& from, std::span<const std::uint32_t> chosen)
    {
        h_ = from.h_;
        runs_ = from.runs_;
        const auto add = [&](auto& list, const auto& other) {
            const std::size_t begin = list.size();
            list.resize(begin + chosen.size());
            for (std::size_t k = 0; k < chosen.size(); ++k) list[begin + k] = other[chosen[k]];
        };
        add(length_, from.length_);
        add(died_, from.died_);
        for (std::size_t column = 0; column < std::min(runs_, max_columns); ++column) {
            add(P_[column], from.P_[column]);
            add(v_[column], from.v_[column]);
        }
    }

    void begin_run()
    {
        const std::size_t column = std::min(runs_++, max_columns - 1);
        P_[column].resize(length_.size());
        v_[column].resize(length_.size());
    }

    // The squared differences of the last two runs, and of the last two columns of the table, m²: in position at the
    // end of this frame, or of the next one due to the difference in velocity.
    struct Difference {
        double run, best;
    };

    // Adds the run of point i; P and v: the best current estimate.
    Difference add(std::size_t i, const BlockResult& end, Vec3d& P, Vec3d& v)
    {
        P = end.P[i];
        v = end.v[i];
        const bool dies = !end.dead.empty() && end.dead[i];
        const bool lives = !dies && !died_[i], is_series = !dies && end.path[i] != PathKind::Broken;
        constexpr double infinity = std::numeric_limits<double>::infinity();
        Difference off{infinity, infinity};
        if (lives && runs_ > 1)
            // Runs that find a contact at the end of the same substep share its error.
            off.run = off.best = std::max(distance2(P - P_[0][i], v - v_[0][i]), squared(end.position_errors[i]));
        else if (dies && died_[i])
            off = {0, 0};
        const std::size_t known = lives && is_series ? std::min<std::size_t>(length_[i], max_columns - 1) : 0;
        double power = 1;
        for (std::size_t c = 0; c < known; ++c) {
            power *= end.path[i] == PathKind::Acted ? 2 : 4;
            const Vec3d dP = P - P_[c][i], dv = v - v_[c][i];
            P_[c][i] = P;
            v_[c][i] = v;
            P += dP / (power - 1);
            v += dv / (power - 1);
            off.best = distance2(dP, dv) / squared(std::min(power - 1, max_trust));
        }
        P_[known][i] = P;
        v_[known][i] = v;
        length_[i] = static_cast<std::uint8_t>(is_series ? known + 1 : 0);
        died_[i] = dies;
        return off;
    }

    bool has_improved(std::size_t i) const { return length_[i] > 1; }

private:
    static double squared(double x) { return x * x; }

    // The largest divisor of a difference of two columns for the error of the second. The series itself has 15, 63 and
    // so on. If steps are still too coarse for it, as in a close encounter with an attractor, columns that differ by
    // 0.05 m may have an error of 0.02 m: 3 is safe there, and elsewhere columns converge so fast that it costs
    // nothing.
    static constexpr double max_trust = 3;
    static constexpr std::size_t max_columns = 6;  // higher powers of the step add only rounding

    double distance2(const Vec3d& dP, const Vec3d& dv) const
    {
        return std::max(dP.squaredNorm(), squared(h_) * dv.squaredNorm());
    }

    double h_ = 0;  // s, frame length
    std::size_t runs_ = 0;
    std::vector<std::uint8_t> length_;  // columns that the next run can extend
    std::vector<std::uint8_t> died_;    // in the last run
    std::array<std::vector<Vec3d>, max_columns> P_, v_;
};

// Decides if a run may be a point's result, and if it is the last one.
struct StepDoublingLimits {
    double tolerance;    // m
    int first_substeps;  // for a point's first run
    int max_substeps;
    double h;             // s, frame length
    std::uint8_t* met;    // set to 1 for points that meet a shape, by index in the set; may be null
    std::int32_t* taken;  // set to the substeps of a point's result; may be null
    bool repeats;         // a block may run through the frame more than once

    bool is_first(int substeps) const { return substeps == first_substeps; }
    // One run has no error estimate, so there is a second even beyond max_substeps, but only for the error.
    bool may_be_result(int substeps) const { return is_first(substeps) || substeps <= max_substeps; }
    // Returns true if it is also the result of points that still miss the tolerance.
    bool is_result_of_all(int substeps) const { return may_be_result(substeps) && substeps > max_substeps / 2; }
    bool is_last(int substeps) const { return !is_first(substeps) && substeps > max_substeps / 2; }
};

// Points that need further runs, all with the same number of runs so far.
struct UnfinishedPoints {
    std::vector<std::uint32_t> indices;  // in the set
    Extrapolation extrapolation;

    void append(const UnfinishedPoints& other);
};

// One traversal of a set, or of its unfinished points.
class StepDoubling final : public Refinement {
public:
    // substeps: for the next run. P and v: of all points, for the results. unfinished: the points to solve, as a
    // separate set; null: all points, from their first run on.
    StepDoubling(const StepDoublingLimits& limits, int substeps, std::span<Vec3f> P, std::span<Vec3f> v,
                 const UnfinishedPoints* unfinished);

    bool takes_exact() const override { return limits_.is_first(substeps_); }
    std::unique_ptr<BlockRefinement> begin() override;

    // Afterwards: the points that need further runs, by their next substeps, and the dead points.
    std::map<int, UnfinishedPoints> unfinished();
    std::span<const std::uint32_t> dead() const { return dead_; }

    int largest_substeps() const { return largest_substeps_; }
    // Returns the number of points that miss the tolerance at max_substeps.
    std::uint64_t beyond_tolerance() const { return beyond_tolerance_; }

private:
    class Block;

    std::uint32_t index_in_set(std::uint32_t solved) const { return from_ ? from_->indices[solved] : solved; }

    const StepDoublingLimits& limits_;
    const int substeps_;
    const std::span<Vec3f> P_, v_;
    const UnfinishedPoints* const from_;

    std::mutex mutex_;
    std::vector<std::pair<int, UnfinishedPoints>> unfinished_;
    std::vector<std::uint32_t> dead_;
    int largest_substeps_ = 0;
    std::uint64_t beyond_tolerance_ = 0;
};

void UnfinishedPoints::append(const UnfinishedPoints& other)
{
    std::vector<std::uint32_t> all(other.indices.size());
    std::iota(all.begin(), all.end(), 0u);
    extrapolation.append(other.extrapolation, all);
    indices.insert(indices.end(), other.indices.begin(), other.indices.end());
}

// The runs of one block.
class StepDoubling::Block final : public BlockRefinement {
public:
    explicit Block(StepDoubling& all) : all_(all), limits_(all.limits_) {}

    void begin(std::span<const std::uint32_t> indices) override
    {
        const std::size_t size = indices.size();
        substeps_ = all_.substeps_;
        indices_.resize(size);
        for (std::size_t i = 0; i < size; ++i) indices_[i] = all_.index_in_set(indices[i]);
        if (all_.from_)
            extrapolation_.select(all_.from_->extrapolation, indices);
        else
            extrapolation_.reset(size, limits_.h);
        open_.resize(size);
        std::iota(open_.begin(), open_.end(), 0u);
        result_.assign(size, Result::Open);
        best_P_.resize(size);
        best_v_.resize(size);
        P_.resize(size);
        v_.resize(size);
    }

    int take(const BlockResult& end) override
    {
        estimate_errors(end);
        accept(end);
        const int substeps = substeps_;
        substeps_ *= 2;
        if (!open_.empty() && !limits_.is_last(substeps)) {
            // An unnecessary run of some points costs less than gathering the others.
            const bool are_most = 4 * open_.size() >= 3 * indices_.size();
            if (limits_.repeats && (are_most || limits_.is_result_of_all(substeps))) return substeps_;
        }
        finish(substeps);
        return 0;
    }

private:
    enum class Verdict : std::uint8_t { TooFar, WithinIfExtrapolated, Within };  // of the tolerance
    enum class Result : std::uint8_t { Open, Known, Dead };

    // Compares the errors of the open points with the tolerance.
    void estimate_errors(const BlockResult& end)
    {
        const bool first = limits_.is_first(substeps_), may_be_result = limits_.may_be_result(substeps_);
        const double allowed = limits_.tolerance * limits_.tolerance;
        extrapolation_.begin_run();
        verdict_.assign(indices_.size(), Verdict::Within);
        extrapolated_.assign(indices_.size(), 0);
        for (const std::uint32_t i : open_) {
            if (end.path[i] == PathKind::Exact) continue;
            if (limits_.met && end.path[i] == PathKind::Broken) limits_.met[indices_[i]] = 1;
            const Extrapolation::Difference off = extrapolation_.add(i, end, best_P_[i], best_v_[i]);
            const bool within = !first && (may_be_result ? off.best : off.run) <= allowed;
            verdict_[i] = !within              ? Verdict::TooFar
                          : off.run <= allowed ? Verdict::Within
                                               : Verdict::WithinIfExtrapolated;
            extrapolated_[i] =
                may_be_result && (within || limits_.is_result_of_all(substeps_)) && extrapolation_.has_improved(i);
        }
        if (!first) keep_outside(end.obstacles, end.indices, best_P_, extrapolated_);
    }

    // Keeps the results that are good enough, or final. Leaves points open that need another run.
    void accept(const BlockResult& end)
    {
        const bool may_be_result = limits_.may_be_result(substeps_);
        const bool is_result_of_all = limits_.is_result_of_all(substeps_);
        std::size_t open = 0;
        for (const std::uint32_t i : open_) {
            const bool within =
                verdict_[i] == Verdict::Within || (extrapolated_[i] && verdict_[i] == Verdict::WithinIfExtrapolated);
            if (may_be_result && (within || is_result_of_all)) {
                P_[i] = extrapolated_[i] ? best_P_[i].cast<float>() : end.rounded[i];
                v_[i] = (extrapolated_[i] ? best_v_[i] : end.v[i]).cast<float>();
                if (limits_.taken) limits_.taken[indices_[i]] = substeps_;
                result_[i] = !end.dead.empty() && end.dead[i] ? Result::Dead : Result::Known;
            }
            if (!within) open_[open++] = i;
        }
        open_.resize(open);
    }

    // Ends the block, after a run with this many substeps.
    void finish(int substeps)
    {
        for (std::size_t i = 0; i < indices_.size(); ++i) {
            if (result_[i] != Result::Known) continue;
            all_.P_[indices_[i]] = P_[i];
            all_.v_[indices_[i]] = v_[i];
        }
        const std::scoped_lock lock(all_.mutex_);
        for (std::size_t i = 0; i < indices_.size(); ++i)
            if (result_[i] == Result::Dead) all_.dead_.push_back(indices_[i]);
        all_.largest_substeps_ =
            std::max(all_.largest_substeps_, limits_.may_be_result(substeps) ? substeps : substeps / 2);
        if (limits_.is_last(substeps)) {
            all_.beyond_tolerance_ += open_.size();
        } else if (!open_.empty()) {
            UnfinishedPoints rest;
            rest.extrapolation.select(extrapolation_, open_);
            for (const std::uint32_t i : open_) rest.indices.push_back(indices_[i]);
            all_.unfinished_.emplace_back(2 * substeps, std::move(rest));
        }
    }

    StepDoubling& all_;
    const StepDoublingLimits& limits_;

    int substeps_ = 1;                    // of the run
    std::vector<std::uint32_t> indices_;  // in the set
    Extrapolation extrapolation_;
    std::vector<std::uint32_t> open_;  // points without a good enough result, by index in the block
    std::vector<Verdict> verdict_;
    std::vector<std::uint8_t> extrapolated_;  // the extrapolation is the result
    std::vector<Vec3d> best_P_, best_v_;      // extrapolations
    std::vector<Result> result_;
    std::vector<Vec3f> P_, v_;  // results, if known
};

StepDoubling::StepDoubling(const StepDoublingLimits& limits, int substeps, std::span<Vec3f> P, std::span<Vec3f> v,
                           const UnfinishedPoints* unfinished)
    : limits_(limits), substeps_(substeps), P_(P), v_(v), from_(unfinished)
{
}

std::unique_ptr<BlockRefinement> StepDoubling::begin() { return std::make_unique<Block>(*this); }

std::map<int, UnfinishedPoints> StepDoubling::unfinished()
{
    std::sort(unfinished_.begin(), unfinished_.end(),
              [](const auto& a, const auto& b) { return a.second.indices.front() < b.second.indices.front(); });
    std::map<int, UnfinishedPoints> all;
    for (const auto& [substeps, some] : unfinished_) all[substeps].append(some);
    return all;
}

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

namespace {

constexpr int frames_between = 4;
constexpr std::size_t all = 1250, some = 250;  // points checked of up to `all` points; of more points

double fraction_beyond(PointSet finer, const PointSet& solved, const Dynamics& dynamics, SolveOptions options,
                       double tolerance, int max_substeps)
{
    options.substeps *= 3;
    options.sinks = {};
    solve_within(finer, dynamics, options, tolerance / 4, max_substeps);
    const IdIndex indices(solved.id());
    std::size_t compared = 0, beyond_tolerance = 0;
    for (std::size_t k = 0; k < finer.size(); ++k) {
        const std::uint32_t i = indices[finer.id()[k]];
        if (i == IdIndex::none) continue;
        ++compared;
        const Vec3d off = solved.P()[i].cast<double>() - std::as_const(finer).P()[k].cast<double>();
        beyond_tolerance += off.norm() > tolerance / 2;
    }
    return compared > 0 ? static_cast<double>(beyond_tolerance) / static_cast<double>(compared) : 0;
}

}  // namespace

std::uint64_t ToleranceCheck::beyond_tolerance(const PointSet& sample, const PointSet& solved, const Dynamics& dynamics,
                                               const SolveOptions& options, double tolerance, int max_substeps)
{
    const int frame = frames_++;
    if (frame < frames_between || frame % frames_between == 0) {
        std::vector<std::uint32_t> chosen;
        const std::size_t every = solved.size() <= all ? 1 : std::max<std::size_t>(1, sample.size() / some);
        for (std::size_t k = 0; k < sample.size(); k += every) chosen.push_back(static_cast<std::uint32_t>(k));
        part_ = chosen.empty()
                    ? 0
                    : fraction_beyond(sample.select(chosen), solved, dynamics, options, tolerance, max_substeps);
    }
    return static_cast<std::uint64_t>(std::ceil(part_ * static_cast<double>(solved.size())));
}

}  // namespace rapid

// Step doubling: runs of points through a frame with n, 2n, 4n, ... substeps, until each point's result is good enough
// (error_control.h). The runs of a block are taken while it is in cache.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "runtime/solver/refinement.h"

namespace rapid {

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

}  // namespace rapid

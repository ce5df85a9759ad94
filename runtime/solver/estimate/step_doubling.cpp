#include "runtime/solver/estimate/step_doubling.h"

#include <algorithm>
#include <numeric>

#include "runtime/solver/collision/obstacle.h"

namespace rapid {

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

}  // namespace rapid

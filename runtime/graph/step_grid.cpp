#include "runtime/graph/step_grid.h"

#include <cmath>
#include <vector>

#include "runtime/error.h"

namespace rapid {
namespace {

// Births of two fogs, a part of them in the second: in proportion to the density between both.
class ScatterInBoth final : public Scatter {
public:
    ScatterInBoth(ScatterPtr a, ScatterPtr b, double part_of_b) : a_(std::move(a)), b_(std::move(b)), part_(part_of_b)
    {
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        constexpr std::uint64_t choice = 15;
        std::vector<Birthplace> others(out.size());
        a_->place(key, first, out);
        b_->place(key, first, others);
        for (std::size_t i = 0; i < out.size(); ++i)
            if (uniform4(key, first + i, choice)[0] < part_) out[i] = others[i];
    }

private:
    ScatterPtr a_, b_;
    double part_;
};

// The grid of a sequence in one step: values on a straight line from a to b; null is 0 everywhere.
template <class G>
class StepGrid : public G {
public:
    using Value = typename G::Value;
    using Interval = typename GridSequence<G>::Interval;

    // Of a step from `begin`, s since the start, that lasts so long.
    StepGrid(Interval interval, double begin, double duration)
        : interval_(std::move(interval)), begin_(begin), duration_(duration)
    {
    }
    bool varies() const override { return true; }

    void sample(std::span<const Vec3d> P, std::span<Value> values) const override
    {
        sample_by(P, values, [this](std::size_t) { return interval_.end; });
    }
    void sample_at(std::span<const Vec3d> P, std::span<const double> time, std::span<Value> values) const override
    {
        sample_by(P, values, [&](std::size_t i) {
            const double part = duration_ > 0 ? (time[i] - begin_) / duration_ : 1;
            return interval_.begin + part * (interval_.end - interval_.begin);
        });
    }

protected:
    const Interval& interval() const { return interval_; }

private:
    template <class Part>
    void sample_by(std::span<const Vec3d> P, std::span<Value> values, const Part& part) const
    {
        std::vector<Value> others(P.size(), zero());
        if (interval_.a)
            interval_.a->sample(P, values);
        else
            std::fill(values.begin(), values.end(), zero());
        if (interval_.b) interval_.b->sample(P, others);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double b = part(i);
            values[i] = values[i] * (1 - b) + others[i] * b;
        }
    }
    static Value zero()
    {
        if constexpr (std::is_same_v<Value, double>)
            return 0;
        else
            return Value::Zero();
    }

    Interval interval_;
    double begin_, duration_;
};

class StepFog final : public StepGrid<DensityGrid> {
public:
    StepFog(const Interval& between, double begin, double duration)
        : StepGrid(between, begin, duration),
          a_(between.a ? (1 - between.end) * between.a->total() : 0),
          b_(between.b ? between.end * between.b->total() : 0)
    {
        if (b_ == 0)
            scatter_ = between.a ? between.a->scatter() : nullptr;
        else if (a_ == 0)
            scatter_ = between.b->scatter();
        else
            scatter_ = std::make_shared<ScatterInBoth>(between.a->scatter(), between.b->scatter(), b_ / (a_ + b_));
    }
    const ScatterPtr& scatter() const override
    {
        if (!scatter_) throw Error("there is no fog at this frame; end the births there, or let the sequence hold");
        return scatter_;
    }
    double total() const override { return a_ + b_; }

private:
    double a_, b_;  // what each gives to the total at the end
    ScatterPtr scatter_;
};

// The part of the sequence from one whole frame to the next that a step is.
template <class G>
typename GridSequence<G>::Interval interval_of(const GridSequence<G>& sequence, double from, double to)
{
    const auto frame = static_cast<std::int64_t>(std::floor(from));
    typename GridSequence<G>::Interval interval = sequence.over(frame);
    const double begin = interval.begin, slope = interval.end - begin;
    interval.begin = begin + slope * (from - static_cast<double>(frame));
    interval.end = begin + slope * (to - static_cast<double>(frame));
    return interval;
}

}  // namespace

bool is_grid_sequence(const Object& object)
{
    return dynamic_cast<const GridSequence<VectorGrid>*>(&object) ||
           dynamic_cast<const GridSequence<DensityGrid>*>(&object);
}

ObjectPtr step_grid(const ObjectPtr& object, const FrameClock& clock, const Frame& frame)
{
    const std::int64_t step = clock.step_at(frame);
    const bool is_start = step <= clock.start;
    const Frame begin = clock.at_step(is_start ? clock.start : step - 1);
    const double to = is_start ? begin.number : clock.at_step(step).number;
    const double duration = is_start ? 0 : 1 / clock.steps_per_second();
    if (const auto vectors = std::dynamic_pointer_cast<const GridSequence<VectorGrid>>(object))
        return std::make_shared<StepGrid<VectorGrid>>(interval_of(*vectors, begin.number, to), begin.time, duration);
    if (const auto fog = std::dynamic_pointer_cast<const GridSequence<DensityGrid>>(object))
        return std::make_shared<StepFog>(interval_of(*fog, begin.number, to), begin.time, duration);
    return nullptr;
}

}  // namespace rapid

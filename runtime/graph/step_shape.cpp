#include "runtime/graph/step_shape.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/frame.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/value.h"
#include "runtime/shapes/level_set/grid_sequence.h"
#include "runtime/shapes/level_set/level_set_tools.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/deforming.h"
#include "runtime/shapes/motion/level_set_sequence.h"
#include "runtime/shapes/motion/mesh_surface.h"
#include "runtime/shapes/motion/moving.h"

namespace rapid {
namespace {

// A time-dependent grid during one step. It is created in advance on the calling thread, when functions of the frame
// are called (step_shape.h).

// Births in two fogs, a fraction of them in the second, in proportion to the density of both.
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

// The grid of a sequence in one step: values interpolated linearly from a to b; null is 0 everywhere.
template <class G>
class StepGrid : public G {
public:
    using Value = typename G::Value;
    using Interval = typename GridSequence<G>::Interval;

    // For a step from `begin`, s since the start, with this duration.
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
        if (!scatter_)
            throw Error("there is no fog at this frame; stop the births, or give the sequence after = \"hold\"");
        return scatter_;
    }
    double total() const override { return a_ + b_; }

private:
    double a_, b_;  // contribution of each to the total at the end
    ScatterPtr scatter_;
};

// Returns the part of the sequence's interval between whole frames that a step covers.
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

// Returns true if an object is a sequence of grids.
bool is_grid_sequence(const Object& object)
{
    return dynamic_cast<const GridSequence<VectorGrid>*>(&object) ||
           dynamic_cast<const GridSequence<DensityGrid>*>(&object);
}

// Returns a sequence of grids in the step that ends at `frame`, as a vector grid or a fog; null for any other object.
// Throws Error if a file cannot be read.
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

// The step that ends at a frame, in frames.
struct Step {
    const FrameClock& clock;
    std::int64_t number;

    bool is_start() const { return number <= clock.start; }
    double from() const { return clock.at_step(number - 1).number; }
    double to() const { return clock.at_step(number).number; }
};

ShapePtr rigid_in_step(const AnimatedShape& shape, const Step& step)
{
    if (!step.is_start()) return moving_in_step(shape, step.clock, step.number, {}).shape;
    const Pose pose = shape.motion()->at(step.clock.at_step(step.clock.start));
    if (const auto level_set = std::dynamic_pointer_cast<const LevelSet>(shape.rest()))
        return move_level_set(level_set, pose);
    return placed(shape.rest(), pose);
}

ShapePtr deforming_in_step(const DeformingLevelSetPtr& body, const Step& step)
{
    const FrameClock frames{step.clock.fps, step.clock.start};
    if (step.is_start()) return body->at(frames, step.clock.start, 0);
    return Deformation(body).over(frames, step.from(), step.to(), nullptr, {}, 0).shape;
}

ShapePtr sequence_in_step(const LevelSetSequence& sequence, const Step& step)
{
    const FrameClock frames{step.clock.fps, step.clock.start};
    const auto start = static_cast<double>(step.clock.start);
    return step.is_start() ? sequence.over(frames, start, start) : sequence.over(frames, step.from(), step.to());
}

// A shape far away, for intervals in which a sequence has no data.
class EmptyShape final : public Shape {
public:
    Box3d bounds() const override { return Box3d(); }
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        constexpr double far = 1e30;
        std::fill_n(phi.begin(), P.size(), far);
        std::fill(gradient.begin(), gradient.end(), Vec3d::Zero());
    }
    void first_contact(std::span<const Path>, std::span<Contact> contacts) const override
    {
        std::fill(contacts.begin(), contacts.end(), Contact());
    }
};

ShapePtr shape_in_step(const ObjectPtr& object, const Step& step)
{
    if (const auto sequence = std::dynamic_pointer_cast<const LevelSetSequence>(object)) {
        const ShapePtr shape = sequence_in_step(*sequence, step);
        return shape ? shape : std::make_shared<EmptyShape>();
    }
    if (const auto shape = std::dynamic_pointer_cast<const AnimatedShape>(object)) return rigid_in_step(*shape, step);
    if (const auto body = std::dynamic_pointer_cast<const DeformingLevelSet>(object))
        return deforming_in_step(body, step);
    if (const auto mesh = std::dynamic_pointer_cast<const AnimatedMesh>(object))
        return step.is_start() ? mesh_surface_at_start(*mesh, step.clock)
                               : mesh_surface_in_step(*mesh, step.clock, step.number);
    if (const auto mesh = std::dynamic_pointer_cast<const Mesh>(object)) return mesh_surface(mesh);
    return nullptr;
}

const StepShapeUser* user_in(const Value& value)
{
    const ObjectPtr* object = value.get<ObjectPtr>();
    return object ? dynamic_cast<const StepShapeUser*>(object->get()) : nullptr;
}

bool takes_step_curves(const Param& param) { return param.type == StepCurves::param_type; }
bool takes_step_shape(const Param& param) { return param.type.ends_with(StepShape::param_type); }

}  // namespace

bool is_moving_shape(const Object& object)
{
    return dynamic_cast<const AnimatedShape*>(&object) || dynamic_cast<const DeformingLevelSet*>(&object) ||
           dynamic_cast<const AnimatedMesh*>(&object) || dynamic_cast<const LevelSetSequence*>(&object);
}

std::shared_ptr<const StepShape> step_shape(const ObjectPtr& given, const FrameClock& clock, const Frame& frame)
{
    const Step step{clock, clock.step_at(frame)};
    const ObjectPtr moving = in_motion(given), object = moving ? moving : given;
    const ShapePtr shape = shape_in_step(object, step);
    if (!shape) return nullptr;
    if (step.is_start()) return std::make_shared<StepShape>(shape, 0, 0);
    const auto mesh = std::dynamic_pointer_cast<const AnimatedMesh>(object);
    const ShapePtr at_rest = mesh && !mesh->deforms() ? mesh_surface(mesh->rest()) : nullptr;
    return std::make_shared<StepShape>(shape, clock.at_step(step.number - 1).time, 1 / clock.steps_per_second(),
                                       at_rest);
}

Value in_step(const Param& param, const Value& value, const FrameClock& clock, const Frame& frame)
{
    const ObjectPtr* object = value.get<ObjectPtr>();
    if (const StepShapeUser* user = user_in(value)) user->begin_step(clock, frame);
    if (!object) return value;
    if (const ObjectPtr grid = step_grid(*object, clock, frame)) return grid;
    if (takes_step_curves(param))
        if (const auto curves = step_curves(*object, clock, frame)) return Value(ObjectPtr(curves));
    if (!takes_step_shape(param)) {
        const auto sequence = std::dynamic_pointer_cast<const LevelSetSequence>(*object);
        if (!sequence) return value;
        const Step step{clock, clock.step_at(frame)};
        const double number = step.is_start() ? static_cast<double>(clock.start) : step.to();
        const ObjectPtr there = param.type == Shape::param_type
                                    ? ObjectPtr(sequence_in_step(*sequence, step))
                                    : ObjectPtr(sequence->at(static_cast<std::int64_t>(std::ceil(number))));
        return there ? Value(there) : Value();
    }
    const auto shape = step_shape(*object, clock, frame);
    return shape ? Value(ObjectPtr(shape)) : value;
}

bool differs_by_step(const Param& param, const Value& value)
{
    if (const StepShapeUser* user = user_in(value)) return user->queries_moving_shapes();
    const ObjectPtr* object = value.get<ObjectPtr>();
    if (!object || !*object) return false;
    if (takes_step_curves(param) && (*object)->varies()) return true;
    if (dynamic_cast<const LevelSetSequence*>(object->get())) return true;
    return is_grid_sequence(**object) || (takes_step_shape(param) && is_moving_shape(**object));
}

void AnyShape::distance(const Chunk& chunk, std::span<double> phi, std::span<Vec3d> gradient) const
{
    if (!step) return shape->distance(chunk.P, phi, gradient);
    std::vector<double> since(chunk.time.begin(), chunk.time.end());
    for (double& time : since) time -= step->begin();
    step->distance_at(chunk.P, since, phi, gradient);
}

void read_value(const Param& param, const Value& value, AnyShape& field)
{
    read_value(param, value, field.shape);
    field.step = std::dynamic_pointer_cast<const StepShape>(field.shape);
}

void StepCurves::at(double time, std::vector<Vec3d>& P, std::vector<Vec3d>& v) const
{
    const double t = duration_ > 0 ? std::clamp((time - begin_) / duration_, 0.0, 1.0) : 1;
    P.resize(cubics_.size());
    v.resize(cubics_.size());
    for (std::size_t i = 0; i < cubics_.size(); ++i) {
        P[i] = cubics_[i].at(t);
        v[i] = duration_ > 0 ? Vec3d(cubics_[i].derivative(t) / duration_) : Vec3d::Zero();
    }
}

std::shared_ptr<const StepCurves> step_curves(const ObjectPtr& object, const FrameClock& clock, const Frame& frame)
{
    const auto moving = std::dynamic_pointer_cast<const MovingCurves>(object);
    if (!moving) return nullptr;
    const std::int64_t step = clock.step_at(frame);
    const bool is_start = step <= clock.start;
    const Frame end = clock.at_step(is_start ? clock.start : step), begin = clock.at_step(is_start ? step : step - 1);
    if (!moving->has(is_start ? end.number : begin.number, end.number))
        return std::make_shared<StepCurves>(nullptr, std::vector<Cubic<Vec3d>>(), begin.time, 0);

    // Deforming objects are known only at whole frames.
    FrameClock known = clock;
    if (moving->deforms()) known.subframes = 1;
    const int parts = clock.subframes / known.subframes;
    const std::int64_t last = clock.start + (step - clock.start + parts - 1) / parts;
    const FramePath path = is_start ? FramePath() : path_of(*moving, known, last, {});
    std::vector<Cubic<Vec3d>> cubics = point_curves(*moving, known, is_start ? clock.start : last, path);
    if (parts > 1 && !is_start)
        for (Cubic<Vec3d>& cubic : cubics) {
            const double from = static_cast<double>((step - 1 - clock.start) % parts) / parts;
            cubic = cubic_part(cubic, from, from + 1.0 / parts);
        }
    return std::make_shared<StepCurves>(moving->rest()->lines(), std::move(cubics), begin.time,
                                        is_start ? 0 : 1 / clock.steps_per_second());
}

}  // namespace rapid

// A shape that moves or deforms during one step, or the surface of a mesh: the value of a parameter that accepts all
// kinds of shapes. It is created in advance on the calling thread, when functions of the frame are called.
#pragma once

#include "runtime/base/frame.h"
#include "runtime/graph/param.h"
#include "runtime/shapes/motion/curves.h"
#include "runtime/shapes/shape.h"
#include "runtime/solver/forces.h"

namespace rapid {

class StepShape final : public Shape {
public:
    // The type of a parameter that accepts one ends with this.
    static constexpr std::string_view param_type = "shape at rest or moving";

    // shape: with times in seconds since the beginning of the step. begin: of the step, s since the start of the
    // simulation. at_rest: the surface of a mesh that moves as a rigid body, else null.
    StepShape(ShapePtr shape, double begin, double duration, ShapePtr at_rest = nullptr)
        : shape_(std::move(shape)), at_rest_(std::move(at_rest)), begin_(begin), duration_(duration)
    {
    }

    const Shape& shape() const { return *shape_; }
    const Shape* at_rest() const { return at_rest_.get(); }
    double begin() const { return begin_; }
    double duration() const { return duration_; }  // s; 0 at the start, at which nothing moves

    std::string_view kind() const override { return shape_->kind(); }
    Box3d bounds() const override { return shape_->bounds(); }
    double band() const override { return shape_->band(); }
    double slope_bound() const override { return shape_->slope_bound(); }
    double smallest_feature() const override { return shape_->smallest_feature(); }
    bool moves() const override { return true; }
    std::shared_ptr<const Mesh> surface() const override { return shape_->surface(); }

    // Returns the distance at the end of the step.
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        shape_->distance(P, phi, gradient);
    }
    void distance_at(std::span<const Vec3d> P, std::span<const double> time, std::span<double> phi,
                     std::span<Vec3d> gradient) const override
    {
        shape_->distance_at(P, time, phi, gradient);
    }
    Vec3d velocity_at(const Vec3d& P, double time) const override { return shape_->velocity_at(P, time); }
    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        shape_->first_contact(paths, contacts);
    }

private:
    ShapePtr shape_, at_rest_;
    double begin_, duration_;
};

// Returns true if an object is a moving or deforming shape or mesh.
bool is_moving_shape(const Object& object);

// Returns a moving shape, or a mesh, in the step that ends at `frame`; null for any other object. At the start, before
// any step, nothing moves. Must be called on one thread, because motions may be scripts. Throws the Error of a motion,
// or of a file of a sequence.
std::shared_ptr<const StepShape> step_shape(const ObjectPtr& object, const FrameClock& clock, const Frame& frame);

// Returns an argument as a parameter gets it in that step: a step_shape() or step_curves() if the parameter accepts
// one; a step_grid() for a sequence of grids; for a sequence of level sets, the level set in the step if the parameter
// takes a shape, else the file of the frame, and nil if there is none; otherwise the value itself.
Value in_step(const Param& param, const Value& value, const FrameClock& clock, const Frame& frame);

// Returns true if that differs between steps.
bool differs_by_step(const Param& param, const Value& value);

// A parameter of a force that accepts all kinds of shapes.
struct AnyShape {
    static constexpr std::string_view param_type = StepShape::param_type;

    ShapePtr shape;                         // null if not given
    std::shared_ptr<const StepShape> step;  // the same shape if it moves or is the surface of a mesh

    explicit operator bool() const { return shape != nullptr; }
    // Finds distances of a chunk's points, each at its own time.
    void distance(const Chunk& chunk, std::span<double> phi, std::span<Vec3d> gradient) const;
};
void read_value(const Param& param, const Value& value, AnyShape& field);

// Curves that move or deform during one step, as the value of a force's parameter. They are created in advance on the
// calling thread, when functions of the frame are called (step_shape.h).
class StepCurves final : public Object {
public:
    // The type of a parameter that accepts one.
    static constexpr std::string_view param_type = "list of vec3, points, or curve";
    std::string_view kind() const override { return "moving curve"; }

    // cubics: of each point, over the step. begin: of the step, s since the start of the simulation. lines: null if
    // there is no curve in this step.
    StepCurves(std::shared_ptr<const CurveLines> lines, std::vector<Cubic<Vec3d>> cubics, double begin, double duration)
        : lines_(std::move(lines)), cubics_(std::move(cubics)), begin_(begin), duration_(duration)
    {
    }

    const std::shared_ptr<const CurveLines>& lines() const { return lines_; }
    // Returns the points and their velocities, m/s, at a time since the start, s.
    void at(double time, std::vector<Vec3d>& P, std::vector<Vec3d>& v) const;

private:
    std::shared_ptr<const CurveLines> lines_;
    std::vector<Cubic<Vec3d>> cubics_;
    double begin_, duration_;  // s; 0 at the start, at which nothing moves
};

// Returns null for any other object. Throws the Error of a motion, a script, or a file of a sequence.
std::shared_ptr<const StepCurves> step_curves(const ObjectPtr& object, const FrameClock& clock, const Frame& frame);

}  // namespace rapid

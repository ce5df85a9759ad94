// What forces, actions, colliders and constraints add to the points that travel down a chain, for Solve to apply (paper
// §2.3). They change no point themselves; Solve takes all that are upstream of it, in the order of the chain, and
// cannot tell a native force from a scripted one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "runtime/error.h"
#include "runtime/points/per_point.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/motion/motion.h"
#include "runtime/shapes/shape.h"

namespace rapid {

// The points of a chunk in the middle of a step. State is in double within the frame and rounded to float once, at its
// end; all spans have shape [size].
struct Chunk {
    const PointSet& points;  // columns, at offset `first`
    std::size_t first;
    std::span<Vec3d> P, v;         // now: m, m/s
    std::span<const double> dt;    // s, this sub-step of each point: a newborn's is shorter
    std::span<const double> time;  // s since the start, at the middle of each point's sub-step
    int substep;                   // from 0

    std::size_t size() const { return P.size(); }

    // A parameter's values for this chunk's points.
    template <class T>
    Strided<T> read(const PerPoint<T>& parameter) const
    {
        Strided<T> values = parameter.read(points);
        return {values.data + first * values.stride, values.stride};
    }
};

// What depends linearly on a point's velocity and place, and drag by the square of its speed:
//
//   x'' = ... + ku - k x' + w2q - w2 x - c |x'| x'
//
// The integrator solves it with the constant accelerations together, exactly or without ever blowing up.
struct Linear {
    double k = 0, w2 = 0, c = 0;  // 1/s, 1/s², 1/m
    Vec3d ku = Vec3d::Zero(), w2q = Vec3d::Zero();

    void add(const Linear& other)
    {
        k += other.k;
        w2 += other.w2;
        c += other.c;
        ku += other.ku;
        w2q += other.w2q;
    }
    bool is_zero() const { return k == 0 && w2 == 0 && c == 0; }
};

// A force that is the same for all points, at all times within the frame: an acceleration (m/s²) and its linear part.
struct Uniform {
    Vec3d a = Vec3d::Zero();
    Linear linear = {};
};

// What the forces of one chunk add up to in one sub-step. Accelerations in m/s²; shape [size] once a force needs one a
// point.
class Forces {
public:
    void reset(std::size_t size)
    {
        size_ = size;
        uniform_.setZero();
        per_point_.clear();
        linear_.clear();
    }

    // Towards the velocity u (m/s) at a rate k (1/s).
    void add_drag(std::size_t i, double k, const Vec3d& u)
    {
        Linear& linear = linear_at(i);
        linear.k += k;
        linear.ku += k * u;
    }
    // -c |v| v
    void add_quadratic_drag(std::size_t i, double c) { linear_at(i).c += c; }
    // Towards the place q (m), w2 (1/s²) a metre.
    void add_spring(std::size_t i, double w2, const Vec3d& q)
    {
        Linear& linear = linear_at(i);
        linear.w2 += w2;
        linear.w2q += w2 * q;
    }
    bool has_linear() const { return !linear_.empty(); }
    const Linear& linear(std::size_t i) const { return linear_[i]; }

    void add_uniform(const Vec3d& a) { uniform_ += a; }
    void add(const Uniform& force)
    {
        uniform_ += force.a;
        if (force.linear.is_zero()) return;
        linear_.resize(size_);
        for (Linear& linear : linear_) linear.add(force.linear);
    }
    void add(std::size_t i, const Vec3d& a) { accelerations()[i] += a; }
    // The accelerations of all points, to add to.
    std::span<Vec3d> accelerations()
    {
        if (per_point_.empty()) per_point_.resize(size_, Vec3d::Zero());
        return per_point_;
    }

    bool is_uniform() const { return per_point_.empty(); }
    const Vec3d& uniform() const { return uniform_; }
    Vec3d acceleration(std::size_t i) const { return is_uniform() ? uniform_ : Vec3d(uniform_ + per_point_[i]); }

private:
    Linear& linear_at(std::size_t i)
    {
        if (linear_.empty()) linear_.resize(size_);
        return linear_[i];
    }

    std::size_t size_ = 0;
    Vec3d uniform_ = Vec3d::Zero();
    std::vector<Vec3d> per_point_;
    std::vector<Linear> linear_;
};

class Dynamic {
public:
    virtual ~Dynamic() = default;

    std::string node;   // for messages
    Location location;  // of the node, in the graph file
    std::string group;  // acts on these points only; all when empty
};

using DynamicPtr = std::shared_ptr<const Dynamic>;

// A force: called once a sub-step for each chunk, from any thread.
class Force : public Dynamic {
public:
    virtual void contribute(const Chunk& chunk, Forces& forces) const = 0;

    // The whole of it, where it is uniform: then contribute() is not called.
    virtual std::optional<Uniform> uniform() const { return std::nullopt; }

    // Adds the energy that the chunk's points have by where they are, J/kg, up to a constant of each point's own. False
    // where the force is not the slope of one, as drag is not. Shape [size].
    virtual bool add_potential(const Chunk& chunk, std::span<double> energy) const
    {
        const std::optional<Uniform> force = uniform();
        if (!force || force->linear.k > 0 || force->linear.c > 0) return false;
        const Linear& linear = force->linear;
        for (std::size_t i = 0; i < chunk.size(); ++i)
            energy[i] += 0.5 * linear.w2 * chunk.P[i].squaredNorm() - (force->a + linear.w2q).dot(chunk.P[i]);
        return true;
    }
};

// What an action does in one step.
class ActionPass {
public:
    virtual ~ActionPass() = default;

    // Called once a sub-step for each chunk, from any thread, with the points where they are in the middle of it: may
    // change P and v, add to `force` (N, 0 at first), write columns at chunk.first + i, and mark points as dead, which
    // ends their way. All of shape [size].
    virtual void act(const Chunk& chunk, std::span<Vec3d> force, std::span<std::uint8_t> dead) = 0;
};

// An action operator (paper §2.3): changes points at every sub-step, inside Solve, while they are in cache.
class Action : public Dynamic {
public:
    // Before a step, on one thread: makes the columns that act() writes writable.
    virtual void prepare(PointSet&) const {}
    // Once all of the step are prepared: where columns are is then known. Limits itself to `group`, as it is now. Null
    // where there is nothing to do.
    virtual std::unique_ptr<ActionPass> begin(PointSet& points) const = 0;
};

// When a contact is found (numerics.md, Collision), and what becomes of the point.
enum class Method {
    Continuous,  // on its path, at the time of impact
    Backtrack,   // at the end of the step, taken back along its velocity (paper §4.2)
    Project,     // at the end of the step, moved out along the gradient (paper §4.1)
};
enum class Response { Bounce, Slide, Stick, Die };

class DeformingLevelSet;

class Collider : public Dynamic {
public:
    // What does not move is a shape. Of the rest Solve makes the shape in its way through the frame.
    ShapePtr shape;
    std::shared_ptr<const DeformingLevelSet> deforming;  // in place of a shape
    MotionPtr motion;                                    // null where it does not move as a whole
    std::optional<std::set<std::int64_t>> cuts;          // frames to which it jumps; found where not given
    Method method = Method::Continuous;
    Response response = Response::Bounce;
    std::optional<double> record;    // m/s: contacts at least as fast are written to the hit attributes
    PerPoint<float> bounce{0.5f};    // restitution ε in [0, 1]
    PerPoint<float> friction{0.0f};  // Coulomb μ >= 0
    // The attribute pscale where the points have it, unless the node says otherwise.
    std::optional<PerPoint<float>> radius;
};

}  // namespace rapid

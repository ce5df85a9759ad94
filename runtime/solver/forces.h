// The forces on a chunk of points in one substep: accelerations, and the parts that are linear in velocity and
// position, which the integrator solves exactly (motion/damped_motion.h).
#pragma once

#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/per_point.h"
#include "runtime/points/point_set.h"

namespace rapid {

// The mass of points without the attribute.
inline constexpr float unit_mass = 1;  // kg

class Shape;

// The points of a chunk in the middle of a step. Their state is in double precision within the frame and rounded to
// float once, at its end. All spans have shape [size].
struct Chunk {
    const PointSet& points;  // columns, at offset `first`
    std::size_t first;
    std::span<Vec3d> P, v;         // current: m, m/s
    std::span<const double> dt;    // s, this substep of each point; shorter for a newborn
    std::span<const double> time;  // s since the start, at the middle of each point's substep
    int substep;                   // from 0

    std::size_t size() const { return P.size(); }

    // Returns the values of a parameter for the points of this chunk.
    template <class T>
    Strided<T> read(const PerPoint<T>& parameter) const
    {
        Strided<T> values = parameter.read(points);
        return {values.data + first * values.stride, values.stride};
    }
};

// The part of a force that is linear in velocity and position, and quadratic drag:
//
//   x'' = ... + ku - k x' + w2q - w2 x - c |x'| x'
//
// The integrator solves it together with the constant acceleration, stable at any stiffness.
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

// A spring to the surface of a shape: -w2 φ ∇φ (solver/surface_springs.h).
struct SurfaceSpring {
    double w2 = 0;                 // 1/s²; 0: none
    const Shape* shape = nullptr;  // outlives the step
    double time = 0;               // time of the shape, s (Shape::distance_at), at which the point starts
    bool two_sided = false;        // the distance is above 0 on both sides of the surface
};

// A force that is the same for all points at all times of the frame: an acceleration (m/s²) and a linear part.
struct Uniform {
    Vec3d a = Vec3d::Zero();
    Linear linear = {};
};

// The sum of the forces on one chunk in one substep. Per-point arrays, shape [size], are allocated when the first
// force needs them.
class Forces {
public:
    void reset(std::size_t size)
    {
        size_ = size;
        uniform_.setZero();
        per_point_.clear();
        linear_.clear();
        surface_springs_.clear();
    }

    // Adds a drag towards the velocity u (m/s) at a rate k (1/s).
    void add_drag(std::size_t i, double k, const Vec3d& u)
    {
        Linear& linear = linear_at(i);
        linear.k += k;
        linear.ku += k * u;
    }
    // Adds -c |v| v.
    void add_quadratic_drag(std::size_t i, double c) { linear_at(i).c += c; }
    // Adds a spring to the position q (m), w2 (1/s²) per metre.
    void add_spring(std::size_t i, double w2, const Vec3d& q)
    {
        Linear& linear = linear_at(i);
        linear.w2 += w2;
        linear.w2q += w2 * q;
    }
    void add_surface_spring(std::size_t i, const SurfaceSpring& spring)
    {
        if (surface_springs_.empty()) surface_springs_.resize(size_);
        surface_springs_[i] = spring;
    }
    bool has_linear() const { return !linear_.empty(); }
    const Linear& linear(std::size_t i) const { return linear_[i]; }

    bool has_surface_springs() const { return !surface_springs_.empty(); }
    const SurfaceSpring& surface_spring(std::size_t i) const { return surface_springs_[i]; }

    // Add accelerations, m/s².
    void add_uniform(const Vec3d& a) { uniform_ += a; }
    void add(const Uniform& force)
    {
        uniform_ += force.a;
        if (force.linear.is_zero()) return;
        linear_.resize(size_);
        for (Linear& linear : linear_) linear.add(force.linear);
    }
    void add(std::size_t i, const Vec3d& a) { accelerations()[i] += a; }
    // Returns the accelerations of all points, to add to.
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
    std::vector<SurfaceSpring> surface_springs_;
};

}  // namespace rapid

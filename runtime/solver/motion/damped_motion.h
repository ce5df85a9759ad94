// The exact motion of a point under a constant acceleration, linear drag and a linear spring together:
//
//   x'' = G - k x' - w2 (x - x0),   G: the acceleration at rest at x0
//
// It is solved as one damped oscillator: splitting drag and spring would not be exact (numerics.md, Motion). Stable and
// exact to rounding for k t and w t from 0 to 1e9.
#pragma once

#include <span>
#include <vector>

#include "runtime/solver/dynamics.h"

namespace rapid {

// The state after the time t from x0, with the velocity v: x = x0 + v x_of_v + G x_of_G, x' = v v_of_v + G v_of_G.
struct Propagator {
    double x_of_v = 0, x_of_G = 0, v_of_v = 1, v_of_G = 0;
};

// k: 1/s, at least 0; w2: 1/s², at least 0; t: s, at least 0.
Propagator respond(double k, double w2, double t);

// The same with quadratic drag included.
struct Dragged {
    Propagator by;
    double rate = 0;  // 1/s, mean of k + c |v|
};

// The motion of many springless points under drag, a pack at a time. It exists alongside respond() because points with
// individual drag spend most of their time on exponentials, which take a third of it in packs (bench_forces,
// air_by_attribute).
struct DragPropagators {
    std::vector<double> x_of_v, x_of_G, v_of_v;  // by point; v_of_G is x_of_v

    // Shapes [n].
    void respond(std::span<const double> k, std::span<const double> t);
};

// Calls respond() and caches the last result: neighbours often share k, w2 and t.
class Responder {
public:
    const Propagator& operator()(double k, double w2, double t)
    {
        if (k != k_ || w2 != w2_ || t != t_) last_ = respond(k_ = k, w2_ = w2, t_ = t);
        return last_;
    }

private:
    double k_ = 0, w2_ = 0, t_ = 0;
    Propagator last_;
};

// Returns the acceleration at rest at P.
inline Vec3d acceleration_at_rest(const Vec3d& P, const Vec3d& a, const Linear& linear)
{
    return a + linear.ku + (linear.w2q - linear.w2 * P);
}

// Returns the response after the time t of a point with the velocity v and the acceleration at rest G. Quadratic drag
// combined with a spring is of second order: it slows the velocity at its mean rate, and shortens the path by as much
// as without the spring.
Dragged respond(const Vec3d& v, const Vec3d& G, const Linear& linear, double t, Responder& respond);

// The motion of a point over a step under linear forces.
struct Damped {
    double k, w2;        // of all drag and springs; quadratic drag at its mean rate
    double linear_k, c;  // of linear and of quadratic drag
    Vec3d G;             // the acceleration at rest at its position

    // After the step: the displacement, m, and the velocity, m/s.
    Vec3d travel, v;

    // The parabola that represents the path, with the same end; it never overshoots the path.
    Vec3d path_v, path_a;

    // The forces on the point: G and w2, plus the spring to a surface (surface_springs.h), for whose curved path G is
    // a mean and w2 is 0. For a moving shape, as at the beginning of the path.
    struct Pull {
        Vec3d G;
        double w2;
        SurfaceSpring surface;
    };
    Pull pull;

    static Damped from(const Vec3d& P, const Vec3d& v, const Vec3d& a, const Linear& linear, double t,
                       Responder& respond);

    // Returns the mean acceleration over a time t from a velocity v.
    Vec3d mean_acceleration(const Vec3d& v, double t) const;

    // Returns the part of a time t that a mean acceleration may represent. While quadratic drag slows a point by at
    // most a sixteenth, the mean of its first and last velocities is within 0.1 % of its mean velocity.
    double longest_parabola(const Vec3d& from, double t) const;
};

}  // namespace rapid

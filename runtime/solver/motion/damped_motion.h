// The exact motion of a point that a constant acceleration, linear drag and a linear spring move together:
//
//   x'' = G - k x' - w2 (x - x0),   G: the acceleration at rest at x0
//
// Solved as one damped oscillator; drag and spring one after the other would not be exact (numerics.md, Motion). Stable
// and exact to rounding for k t and w t from 0 to 1e9.
#pragma once

#include <span>
#include <vector>

#include "runtime/solver/dynamics.h"

namespace rapid {

// After the time t from x0, with the velocity v: x = x0 + v x_of_v + G x_of_G, x' = v v_of_v + G v_of_G.
struct Propagator {
    double x_of_v = 0, x_of_G = 0, v_of_v = 1, v_of_G = 0;
};

// k: 1/s, at least 0; w2: 1/s², at least 0; t: s, at least 0.
Propagator respond(double k, double w2, double t);

// The same without springs, of many, several at a time; shapes [n].
struct DragPropagators {
    std::vector<double> x_of_v, x_of_G, v_of_v;  // v_of_G is x_of_v

    void respond(std::span<const double> k, std::span<const double> t);
};

// The same; where it is asked for what it was asked last, as for points that are alike, it knows it.
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

// The acceleration at rest at P.
inline Vec3d acceleration_at_rest(const Vec3d& P, const Vec3d& a, const Linear& linear)
{
    return a + linear.ku + (linear.w2q - linear.w2 * P);
}

// The mean, over a time t, of the speed of a point that starts with `speed` (m/s), is accelerated along its way by a
// (m/s²) and dragged by c speed² (c: 1/m, above 0): by its closed form. A drag of rate c times this over the step never
// turns a velocity round, and leaves the terminal speed √(a/c) as it is.
double mean_speed(double speed, double a, double c, double t);

// The rate of all drag over a time t, as it is along a way in this direction.
double drag_rate_along(const Vec3d& direction, const Vec3d& v, const Vec3d& G, const Linear& linear, double t);

// The rate of all drag over a time t, of a point at the velocity v that G would accelerate at rest; quadratic drag
// counts by the mean speed.
double drag_rate(const Vec3d& v, const Vec3d& G, const Linear& linear, double t);

// A point's way through a step under forces with linear parts.
struct Damped {
    double k, w2;  // of all drag and springs; quadratic drag is a rate by the mean speed
    Vec3d G;       // the acceleration at rest where it is

    // After the step: how far it went, m, and its velocity, m/s.
    Vec3d travel, v;

    // The parabola that stands for it between: the same end, and never beyond it and back.
    Vec3d path_v, path_a;

    static Damped from(const Vec3d& P, const Vec3d& v, const Vec3d& a, const Linear& linear, double t,
                       Responder& respond);

    // The mean acceleration over a time t from a velocity v.
    Vec3d mean_acceleration(const Vec3d& v, double t) const;
};

}  // namespace rapid

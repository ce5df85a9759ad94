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

// After the time t from x0, with the velocity v: x = x0 + v x_of_v + G x_of_G, x' = v v_of_v + G v_of_G.
struct Propagator {
    double x_of_v = 0, x_of_G = 0, v_of_v = 1, v_of_G = 0;
};

// k: 1/s, at least 0; w2: 1/s², at least 0; t: s, at least 0.
Propagator respond(double k, double w2, double t);

// The same of many points without springs, a pack at a time.
struct DragPropagators {
    std::vector<double> x_of_v, x_of_G, v_of_v;  // by point; v_of_G is x_of_v

    // Shapes [n].
    void respond(std::span<const double> k, std::span<const double> t);
};

// The same, with the last result cached: neighbours often share k, w2 and t.
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

// The mean speed over a time t of a point that starts with `speed` (m/s), is accelerated along its motion by a (m/s²)
// and dragged by c speed² (c: 1/m, above 0), in closed form. Linear drag of the rate c times this mean never reverses a
// velocity, and keeps the terminal speed √(a/c).
double mean_speed(double speed, double a, double c, double t);

// The rate of all drag over a time t, for motion in this direction.
double drag_rate_along(const Vec3d& direction, const Vec3d& v, const Vec3d& G, const Linear& linear, double t);

// The rate of all drag over a time t, of a point with the velocity v and the acceleration at rest G; quadratic drag
// counts by the mean speed.
double drag_rate(const Vec3d& v, const Vec3d& G, const Linear& linear, double t);

// The motion of a point through a step under linear forces.
struct Damped {
    double k, w2;  // of all drag and springs; quadratic drag as a rate by the mean speed
    Vec3d G;       // the acceleration at rest at its position

    // After the step: the distance travelled, m, and the velocity, m/s.
    Vec3d travel, v;

    // The parabola that stands for the path, with the same end, and which never overshoots it.
    Vec3d path_v, path_a;

    static Damped from(const Vec3d& P, const Vec3d& v, const Vec3d& a, const Linear& linear, double t,
                       Responder& respond);

    // The mean acceleration over a time t from a velocity v.
    Vec3d mean_acceleration(const Vec3d& v, double t) const;
};

}  // namespace rapid

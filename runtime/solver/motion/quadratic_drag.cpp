#include "runtime/solver/motion/quadratic_drag.h"

#include <algorithm>
#include <cmath>

namespace rapid {
namespace {

// The response of y'' + k y' = b y, b = c g: the impulse response H (H(0) = 0, H'(0) = 1) and derived values, all
// except h scaled by e^(-scale t), which keeps them finite.
//
//   J  = ∫ e^-k(t-s) H(s) ds     by which H' exceeds b times e^-kt
//   h  = (1 - e^-kt)/k
struct ImpulseResponse {
    double H, J, y0, decay, log_scale;  // y0: the response to y(0) = 1, y'(0) = 0; decay: e^-kt
    double Q, J2;                       // ∫ H and ∫ J, if there is a series; log_scale is then 0
    bool is_series;
};

// Taylor series in t; k t up to 2 and |b| t² up to 1, for which terms decrease as 2^n/n!.
ImpulseResponse response_by_series(double k, double b, double t)
{
    const double kt = k * t, bt2 = b * t * t;
    double before = 0, term = 1, j = 0;  // coefficients of H and J
    double H = 1, Q = 0.5, J = 0, J2 = 0;
    for (int n = 2; n < 40; ++n) {
        j = (term - kt * j) / n;
        J += j;
        J2 += j / (n + 1);
        const double next = (bt2 * before / (n - 1) - kt * term) / n;
        before = term;
        term = next;
        H += term;
        Q += term / (n + 1);
        if (std::abs(term) + std::abs(before) < 0x1p-56) break;
    }
    Q *= t * t;
    return {t * H, t * t * J, 1 + b * Q, std::exp(-kt), 0, Q, t * t * t * J2, true};
}

// Closed form with exponentials, R² = k²/4 + b > 0.
ImpulseResponse by_exponentials(double k, double b, double R, double t)
{
    const double rho = R + 0.5 * k, sigma = b / rho;  // H = (e^(sigma t) - e^(-rho t)) / 2R
    const double e = std::exp(-2 * R * t), decay = std::exp(-rho * t);
    const double H = -std::expm1(-2 * R * t) / (2 * R), slope = (sigma + rho * e) / (2 * R);
    return {H, (slope - decay) / b, (rho + sigma * e) / (2 * R), decay, sigma * t, 0, 0, false};
}

// Closed form with sine and cosine, w² = -R² >= 0.
ImpulseResponse by_oscillation(double k, double b, double w, double t)
{
    const double angle = w * t, half = std::exp(-0.5 * k * t), decay = std::exp(-k * t);
    const double H = half * (angle > 0 ? std::sin(angle) / w : t), slope = half * std::cos(angle) - 0.5 * k * H;
    return {H, (slope - decay) / b, slope + k * H, decay, 0, 0, 0, false};
}

ImpulseResponse respond_of(double k, double b, double t)
{
    if (k * t <= 2 && std::abs(b) * t * t <= 1) return response_by_series(k, b, t);
    const double R2 = 0.25 * k * k + b;
    return R2 > 0 ? by_exponentials(k, b, std::sqrt(R2), t) : by_oscillation(k, b, std::sqrt(-R2), t);
}

// ln(1 + x)/x
double log_ratio(double x) { return std::abs(x) < 1e-16 ? 1 : std::log1p(x) / x; }

// Motion along the line without turning. With y'' + k y' = c g y, y(0) = 1, y'(0) = c v, the distance is ln(y)/c, so
// velocities across the line decay by E = e^-kt/y:
//
//   V_v = E                       V_G = E ∫ 1/E = (H + c v J)/y
//   X_v = ln(1 + c v h)/(c v)     as without acceleration
//   X_G = ln(y/(1 + c v h))/(c g) the rest of the distance
Dragged without_reversal(double v, double g, double k, double c, double t)
{
    if (!(t > 0)) return {};
    const double b = c * g;
    const double h = respond(k, 0, t).x_of_v, drag_alone = c * v * h;
    Dragged found;
    found.by.x_of_v = h * log_ratio(drag_alone);
    // An acceleration this weak changes the rate by less than its closed form loses to rounding.
    if (k * t > 2 && std::abs(b) < 1e-8 * k * k) {
        const Propagator r = respond(k, 0, t);
        const double y = 1 + drag_alone, J = (h - t * r.v_of_v) / k, J2 = (r.x_of_G - J) / k;
        found.by.v_of_v = r.v_of_v / y;
        found.by.v_of_G = (h + c * v * J) / y;
        found.by.x_of_G = (r.x_of_G + c * v * J2) / y;
        found.rate = k + std::log1p(drag_alone) / t;
        return found;
    }
    const ImpulseResponse r = respond_of(k, b, t);
    const double y = r.y0 + c * v * r.H;
    const double distance = r.is_series ? std::log1p(b * r.Q + c * v * r.H) : r.log_scale + std::log(y);  // times c
    found.by.v_of_v = r.decay / y;
    found.by.v_of_G = (r.H + c * v * r.J) / y;
    if (r.is_series) {
        const double Q = (r.Q + c * v * r.J2) / (1 + drag_alone);
        found.by.x_of_G = Q * log_ratio(b * Q);
    } else {
        found.by.x_of_G = (distance - std::log1p(drag_alone)) / b;
    }
    found.rate = k + distance / t;
    return found;
}

// Returns the time in which a point of this speed stops, decelerated by g: ∫ dv/(g + k v + c v²) from 0.
double time_to_stop(double v, double g, double k, double c)
{
    const double R2 = 0.25 * k * k - c * g, R = std::sqrt(std::abs(R2)), x = R * v, y = g + 0.5 * k * v;
    if (x < 1e-4 * y) return v / y * (1 + (R2 > 0 ? x / y : -x / y) * (x / y) / 3);
    return (R2 > 0 ? std::atanh(std::min(x / y, 1.0)) : std::atan2(x, y)) / R;
}

// Returns the response over two consecutive times; share: the first time's fraction of both.
Dragged in_sequence(const Dragged& first, double share, const Dragged& second)
{
    const Propagator &a = first.by, &b = second.by;
    return {{a.x_of_v + a.v_of_v * b.x_of_v, a.x_of_G + a.v_of_G * b.x_of_v + b.x_of_G, a.v_of_v * b.v_of_v,
             a.v_of_G * b.v_of_v + b.v_of_G},
            share * first.rate + (1 - share) * second.rate};
}

// Returns the response for a speed that is accelerated along the motion, or decelerated until it stops and then
// accelerated back.
Dragged along_line(double speed, double along, double k, double c, double t)
{
    if (!(along < 0)) return without_reversal(speed, along, k, c, t);
    const double stop = time_to_stop(speed, -along, k, c);
    if (stop >= t) return without_reversal(speed, along, k, c, t);
    return in_sequence(without_reversal(speed, along, k, c, stop), stop / t,
                       without_reversal(0, -along, k, c, t - stop));
}

// Uses the mean direction of the velocities before and after.
Dragged along_mean_direction(const Vec3d& v, const Vec3d& G, double k, double c, double t)
{
    const double speed = v.norm();
    const auto in_direction = [&](const Vec3d& direction) {
        const double size = direction.norm();
        return along_line(speed, size > 0 ? G.dot(direction) / size : 0, k, c, t);
    };
    const Propagator first = in_direction(speed > 0 ? v : G).by;
    return in_direction(v + (v * first.v_of_v + G * first.v_of_G));
}

}  // namespace

Dragged respond_to_quadratic_drag(const Vec3d& v, const Vec3d& G, double k, double c, double t)
{
    if (!(t > 0)) return {};
    const double speed = v.norm(), along = speed > 0 ? G.dot(v) / speed : 0;
    const double stop = along < 0 ? time_to_stop(speed, -along, k, c) : t;
    if (stop >= t) return along_mean_direction(v, G, k, c, t);
    // The point turns back, and then has another direction.
    const Dragged first = along_mean_direction(v, G, k, c, stop);
    return in_sequence(first, stop / t,
                       along_mean_direction(v * first.by.v_of_v + G * first.by.v_of_G, G, k, c, t - stop));
}

}  // namespace rapid

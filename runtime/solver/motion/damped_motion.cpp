#include "runtime/solver/motion/damped_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/math/simd.h"
#include "runtime/solver/motion/quadratic_drag.h"

namespace rapid {
namespace {

constexpr int terms = 22;  // of the series: the last one is below rounding
constexpr auto one_over = [] {
    std::array<double, terms + 2> all{};
    for (int n = 1; n < terms + 2; ++n) all[n] = 1.0 / n;
    return all;
}();

// Taylor series of the impulse response h(t), h'' + k h' + w2 h = 0, h(0) = 0, h'(0) = 1, of its integral and of its
// derivative. For k t and w2 t² up to 1 the terms decrease as 1/n!.
Propagator propagator_by_series(double k, double w2, double t)
{
    const double kt = k * t, w2t2 = w2 * t * t;
    double before = 0, term = 1;  // c_n t^(n-1), from n = 0 and 1
    double h = 1, slope = 1, integral = 0.5;
    for (int n = 2; n <= terms; ++n) {
        const double next = -(kt * term + w2t2 * one_over[n - 1] * before) * one_over[n];
        before = term;
        term = next;
        h += term;
        slope += n * term;
        integral += term * one_over[n + 1];
    }
    return {t * h, t * t * integral, slope, t * h};
}

// Response without a spring, with x = k t: e^-x, (1 - e^-x)/x and (e^-x - 1 + x)/x². Up to x = 1 the last one is a
// series, from which the others follow without cancellation. T: double, or a pack.
template <class T>
struct Decay {
    T slope, h, integral;
};

template <class T>
[[gnu::always_inline]] inline Decay<T> small_decay(const T& x)
{
    T integral = T{} + one_over[terms];
#pragma GCC unroll 32
    for (int n = terms - 1; n >= 2; --n) integral = (1.0 - x * integral) * one_over[n];
    const T h = 1.0 - x * integral;
    return {1.0 - x * h, h, integral};
}

Decay<double> large_decay(double x)
{
    const double slope = std::exp(-x), h = (1 - slope) / x;
    return {slope, h, (1 - h) / x};
}

Propagator respond_to_drag(double k, double t)
{
    const double x = k * t;
    const Decay<double> decay = x <= 1 ? small_decay(x) : large_decay(x);
    return {t * decay.h, t * t * decay.integral, decay.slope, t * decay.h};
}

// (e^x - 1)/x
double e1(double x) { return x == 0 ? 1 : std::expm1(x) / x; }

}  // namespace

Propagator respond(double k, double w2, double t)
{
    if (w2 == 0) return respond_to_drag(k, t);
    if (k * t <= 1 && w2 * t * t <= 1) return propagator_by_series(k, w2, t);
    const double half = 0.5 * k, discriminant = (half - std::sqrt(w2)) * (half + std::sqrt(w2));
    const double root = std::sqrt(std::abs(discriminant));
    if (discriminant > 0 && root * t > 0.125) {  // two decays; their rates without cancellation
        const double fast = -(half + root), slow = -w2 / (half + root);
        const double e_fast = std::exp(fast * t), e_slow = std::exp(slow * t);
        const double h = (e_slow - e_fast) / (2 * root);
        return {h, t * (e1(slow * t) - e1(fast * t)) / (2 * root), (slow * e_slow - fast * e_fast) / (2 * root), h};
    }
    // An oscillation, or nearly critical damping.
    const double angle = root * t, decay = std::exp(-half * t);
    double c, s;  // cos and sin(angle)/angle, or cosh and sinh(angle)/angle
    if (discriminant > 0) {
        c = std::cosh(angle);
        s = angle > 0 ? std::sinh(angle) / angle : 1;
    } else {
        c = std::cos(angle);
        s = angle > 0 ? std::sin(angle) / angle : 1;
    }
    const double h = decay * t * s;
    return {h, (1 - decay * (c + half * t * s)) / w2, decay * (c - half * t * s), h};
}

void DragPropagators::respond(std::span<const double> k, std::span<const double> t)
{
    const std::size_t size = k.size(), padded = (size + lanes - 1) / lanes * lanes;
    for (auto* column : {&x_of_v, &x_of_G, &v_of_v}) column->resize(padded);
    bool small = true;
    for (std::size_t i = 0; i < size; i += lanes) {
        double k_last[lanes] = {}, t_last[lanes] = {};
        const bool whole = size - i >= lanes;
        if (!whole) {
            std::copy(k.begin() + i, k.end(), k_last);
            std::copy(t.begin() + i, t.end(), t_last);
        }
        const Doubles time = load_pack(whole ? &t[i] : t_last), x = load_pack(whole ? &k[i] : k_last) * time;
        const Decay<Doubles> decay = small_decay(x);
        small &= !any(!(x <= 1));
        store_pack(time * decay.h, &x_of_v[i]);
        store_pack(time * time * decay.integral, &x_of_G[i]);
        store_pack(decay.slope, &v_of_v[i]);
    }
    for (std::size_t i = 0; !small && i < size; ++i) {
        const double x = k[i] * t[i];
        if (x <= 1) continue;
        const Decay<double> decay = large_decay(x);
        x_of_v[i] = t[i] * decay.h;
        x_of_G[i] = t[i] * t[i] * decay.integral;
        v_of_v[i] = decay.slope;
    }
}

Dragged respond(const Vec3d& v, const Vec3d& G, const Linear& linear, double t, Responder& respond)
{
    if (!(linear.c > 0) || !(t > 0)) return {respond(linear.k, linear.w2, t), linear.k};
    Dragged dragged = respond_to_quadratic_drag(v, G, linear.k, linear.c, t);
    if (linear.w2 == 0) return dragged;
    const double alone = dragged.by.x_of_v / rapid::respond(dragged.rate, 0, t).x_of_v;
    dragged.by = respond(dragged.rate, linear.w2, t);
    dragged.by.x_of_v *= alone;
    return dragged;
}

Damped Damped::from(const Vec3d& P, const Vec3d& v, const Vec3d& a, const Linear& linear, double t, Responder& respond)
{
    Damped damped;
    damped.c = linear.c;
    damped.w2 = linear.w2;
    damped.G = acceleration_at_rest(P, a, linear);
    damped.pull = {damped.G, linear.w2, {}};
    const auto [r, rate] = rapid::respond(v, damped.G, linear, t, respond);
    damped.k = rate;
    damped.linear_k = linear.k;
    damped.travel = v * r.x_of_v + damped.G * r.x_of_G;
    damped.v = v * r.v_of_v + damped.G * r.v_of_G;
    damped.path_v = t > 0 ? Vec3d(v * (r.x_of_v / t)) : v;
    damped.path_a = t > 0 ? Vec3d(damped.G * (2 * r.x_of_G / (t * t))) : damped.G;
    return damped;
}

Vec3d Damped::mean_acceleration(const Vec3d& from, double t) const
{
    if (!(t > 0)) return G - (linear_k + c * from.norm()) * from;
    Responder responder;
    const Propagator r = respond(from, G, {.k = linear_k, .w2 = w2, .c = c}, t, responder).by;
    return (from * (r.v_of_v - 1) + G * r.v_of_G) / t;
}

double Damped::longest_parabola(const Vec3d& from, double t) const
{
    constexpr double slowed = 1.0 / 16;
    const double speed = from.norm(), rate = c * speed;
    if (!(rate * t > slowed) || rate * speed * speed < 2 * std::abs(G.dot(from))) return t;
    return slowed / rate;
}

}  // namespace rapid

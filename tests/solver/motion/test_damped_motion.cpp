// The damped oscillator, compared with its closed forms in long double.
#include "runtime/solver/motion/damped_motion.h"

#include <cmath>

#include "tests/test.h"

namespace rapid {
namespace {

// Drag alone; for small k t by series, because the closed forms cancel.
struct Exact {
    long double x_of_v, x_of_G, v_of_v;

    Exact(long double k, long double t)
    {
        const long double x = k * t;
        long double phi1 = 0, phi2 = 0, term = 1;
        if (x < 1) {
            for (int n = 1; n < 40; ++n) {
                phi1 += term / n;  // (1 - e^-x)/x
                phi2 += term / (static_cast<long double>(n) * (n + 1));
                term *= -x / n;
            }
        } else {
            phi1 = -std::expm1(-x) / x;
            phi2 = (1 - phi1) / x;
        }
        v_of_v = std::exp(-x);
        x_of_v = t * phi1;
        x_of_G = t * t * phi2;
    }
};

TEST_CASE("drag without a spring is exact to rounding for k t from 1e-9 to 1e9", "[damped]")
{
    const double t = GENERATE(1e-9, 1.0 / 24, 10.0);
    for (double x = 1e-9; x < 2e9; x *= 1.37) {
        CAPTURE(x, t);
        const Propagator found = respond(x / t, 0, t);
        const Exact right(x / t, t);
        CHECK(found.x_of_v == Approx(double(right.x_of_v)).epsilon(1e-15));
        CHECK(found.v_of_G == found.x_of_v);
        CHECK(found.x_of_G == Approx(double(right.x_of_G)).epsilon(1e-15));
        CHECK(found.v_of_v == Approx(double(right.v_of_v)).epsilon(1e-15).margin(1e-16));
    }
}

TEST_CASE("drags of many points have the bits of each alone", "[damped]")
{
    std::vector<double> k, t;
    for (double x = 1e-9; x < 2e9; x *= 3.1) {
        k.push_back(x);
        t.push_back(k.size() % 3 == 0 ? 0 : k.size() % 3 == 1 ? 1.0 : 1.0 / 24);
    }
    DragPropagators many;
    many.respond(k, t);
    for (std::size_t i = 0; i < k.size(); ++i) {
        const Propagator alone = respond(k[i], 0, t[i]);
        CHECK(many.x_of_v[i] == alone.x_of_v);
        CHECK(many.x_of_G[i] == alone.x_of_G);
        CHECK(many.v_of_v[i] == alone.v_of_v);
    }
}

// y'' = -k y' - w2 y + G from y = 0 with y' = v: y = v S + G (1 - S' - k S)/w2 with the response S to an impulse.
TEST_CASE("a damped spring has its closed form below, at and above critical damping", "[damped]")
{
    const double k = GENERATE(0.0, 0.3, 20.0, 1e4), w2 = GENERATE(1.0, 90.0, 100.0, 110.0, 1e6);
    const double t = GENERATE(1.0 / 24, 0.3, 2.0);
    CAPTURE(k, w2, t);
    const long double a = k / 2.0L, discriminant = a * a - w2;
    long double S = 0, slope = 0;
    if (discriminant < 0) {
        const long double w = std::sqrt(-discriminant);
        S = std::exp(-a * t) * std::sin(w * t) / w;
        slope = std::exp(-a * t) * std::cos(w * t) - a * S;
    } else if (discriminant > 0) {
        const long double root = std::sqrt(discriminant), fast = -(a + root), slow = -w2 / (a + root);
        S = (std::exp(slow * t) - std::exp(fast * t)) / (2 * root);
        slope = (slow * std::exp(slow * t) - fast * std::exp(fast * t)) / (2 * root);
    } else {
        S = t * std::exp(-a * t);
        slope = (1 - a * t) * std::exp(-a * t);
    }

    const Propagator found = respond(k, w2, t);
    const double phase = 1e-15 * std::max(1.0, std::sqrt(w2) * t);  // due to a rounded angle
    CHECK(found.x_of_v == Approx(double(S)).epsilon(1e-13).margin(phase / std::sqrt(w2)));
    CHECK(found.v_of_v == Approx(double(slope)).epsilon(1e-13).margin(4 * phase));
    CHECK(found.v_of_G == Approx(double(S)).epsilon(1e-13).margin(phase / std::sqrt(w2)));
    CHECK(found.x_of_G == Approx(double((1 - slope - k * S) / w2)).epsilon(1e-13).margin(4 * phase / w2));
}

TEST_CASE("responses compose: two half times are the whole", "[damped]")
{
    const double k = GENERATE(0.0, 0.3, 20.0, 1e4), w2 = GENERATE(1e-6, 1.0, 90.0, 100.0, 110.0, 1e6);
    const double t = GENERATE(1e-3, 1.0 / 24, 1.0);
    CAPTURE(k, w2, t);
    const Propagator half = respond(k, w2, t / 2), whole = respond(k, w2, t);
    // G is the acceleration at rest at the position of the point: lower by w2 x.
    const auto twice = [&](double v, double G) {
        const double x1 = v * half.x_of_v + G * half.x_of_G, v1 = v * half.v_of_v + G * half.v_of_G;
        const double G1 = G - w2 * x1;
        return std::pair(x1 + v1 * half.x_of_v + G1 * half.x_of_G, v1 * half.v_of_v + G1 * half.v_of_G);
    };
    const double scale = 1e-13 * std::max(1.0, std::sqrt(w2) * t);
    CHECK(whole.x_of_v == Approx(twice(1, 0).first).margin(scale * t));
    CHECK(whole.v_of_v == Approx(twice(1, 0).second).margin(scale));
    CHECK(whole.x_of_G == Approx(twice(0, 1).first).margin(scale * t * t));
    CHECK(whole.v_of_G == Approx(twice(0, 1).second).margin(scale * t));
}

TEST_CASE("the responder caches its last result", "[damped]")
{
    Responder responder;
    for (const double k : {0.0, 2.0, 2.0, 0.0, 30.0})
        for (const double t : {0.0, 0.1, 0.1}) {
            const Propagator known = responder(k, 4, t), found = respond(k, 4, t);
            CHECK(known.x_of_v == found.x_of_v);
            CHECK(known.x_of_G == found.x_of_G);
            CHECK(known.v_of_v == found.v_of_v);
        }
}

}  // namespace
}  // namespace rapid

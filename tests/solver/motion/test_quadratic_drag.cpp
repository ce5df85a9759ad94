// Quadratic drag against closed forms in long double, and against small steps of a Runge-Kutta method.
#include "runtime/solver/motion/quadratic_drag.h"

#include <array>
#include <cmath>
#include <random>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::Scene;

struct State {
    Vec3d x, v;
};

State after(const Vec3d& v, const Vec3d& G, double k, double c, double t, int steps = 1)
{
    State now{Vec3d::Zero(), v};
    for (int step = 0; step < steps; ++step) {
        const Propagator r = respond_to_quadratic_drag(now.v, G, k, c, t / steps).by;
        now.x += now.v * r.x_of_v + G * r.x_of_G;
        now.v = now.v * r.v_of_v + G * r.v_of_G;
    }
    return now;
}

// Runge-Kutta steps of order 4.
State reference(const Vec3d& v, const Vec3d& G, double k, double c, double t)
{
    const auto a = [&](const Vec3d& u) { return Vec3d(G - (k + c * u.norm()) * u); };
    constexpr int steps = 20000;
    const double h = t / steps;
    State now{Vec3d::Zero(), v};
    for (int step = 0; step < steps; ++step) {
        const Vec3d a1 = a(now.v), v2 = now.v + h / 2 * a1, a2 = a(v2), v3 = now.v + h / 2 * a2, a3 = a(v3),
                    v4 = now.v + h * a3;
        now.x += h / 6 * (now.v + 2 * v2 + 2 * v3 + v4);
        now.v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a(v4));
    }
    return now;
}

TEST_CASE("a point that only drag slows has gone a logarithm, for c v t from 1e-9 to 1e15", "[quadratic_drag]")
{
    const double t = 1.0 / 24, k = GENERATE(0.0, 1e-6, 0.3, 24.0, 5e4);
    const Vec3d along = Vec3d(2, -1, 2) / 3;
    for (double x = 1e-9; x < 1e15; x *= 7.3) {
        const double speed = std::sqrt(x), c = x / (speed * t);
        CAPTURE(k, x);
        const long double h = k > 0 ? -std::expm1(-static_cast<long double>(k) * t) / k : t;
        const long double slower = 1 + c * speed * h;
        const State end = after(speed * along, Vec3d::Zero(), k, c, t);
        CHECK(end.x.dot(along) == Approx(double(std::log1p(c * speed * h) / c)).epsilon(1e-14));
        CHECK(end.v.dot(along) ==
              Approx(double(speed * std::exp(-static_cast<long double>(k) * t) / slower)).epsilon(1e-13));
        CHECK(end.x.cross(along).norm() <= 1e-15 * end.x.norm());
    }
    CHECK(after({300, 0, 0}, Vec3d::Zero(), 0, 0.5, t).x.x() == Approx(2 * std::log(7.25)).epsilon(1e-14));
    CHECK(after({5e5, 0, 0}, Vec3d::Zero(), 0, 1e9, t).x.x() == Approx(1e-9 * std::log1p(5e14 / 24)).epsilon(1e-14));
}

TEST_CASE("a fall from rest follows the hyperbolic tangent at any step", "[quadratic_drag]")
{
    const double g = 9.81, t = GENERATE(1e-4, 1.0 / 24, 3.0);
    for (double c = 1e-8; c < 1e10; c *= 11) {
        CAPTURE(c, t);
        const long double terminal = std::sqrt(static_cast<long double>(g) / c), angle = g * t / terminal;
        const State end = after(Vec3d::Zero(), {0, -g, 0}, 0, c, t);
        const long double log_cosh = angle + std::log1p(std::expm1(-2 * angle) / 2);
        CHECK(-end.v.y() == Approx(double(terminal * std::tanh(angle))).epsilon(1e-13));
        CHECK(-end.x.y() == Approx(double(log_cosh / c)).epsilon(angle > 1e-2 ? 1e-12 : 1e-9));
    }
}

TEST_CASE("a point thrown up stops where and when its closed form does, and falls again, in one step",
          "[quadratic_drag]")
{
    const double g = 9.81, c = GENERATE(1e-3, 0.1, 20.0), speed = GENERATE(0.2, 5.0, 200.0);
    CAPTURE(c, speed);
    const double terminal = std::sqrt(g / c), stop = terminal / g * std::atan(speed / terminal);
    const State top = after({0, speed, 0}, {0, -g, 0}, 0, c, stop);
    CHECK(top.v.norm() <= 1e-12 * speed);
    CHECK(top.x.y() == Approx(std::log1p(c * speed * speed / g) / (2 * c)).epsilon(1e-12));
    const State later = after({0, speed, 0}, {0, -g, 0}, 0, c, stop + 0.3);
    CHECK(later.v.y() == Approx(-terminal * std::tanh(0.3 * g / terminal)).epsilon(1e-9));
    CHECK(later.x.y() == Approx(top.x.y() - std::log(std::cosh(0.3 * g / terminal)) / c).epsilon(1e-9));
}

TEST_CASE("with linear and quadratic drag and an acceleration along the motion, any number of steps is the same",
          "[quadratic_drag]")
{
    std::mt19937 random(11);
    const auto between = [&](double a, double b) {
        return std::exp(std::uniform_real_distribution<>(std::log(a), std::log(b))(random));
    };
    for (int scene = 0; scene < 3000; ++scene) {
        const double k = scene % 3 == 0 ? 0 : between(1e-3, 300), c = between(1e-4, 100), t = between(1e-3, 2);
        const double speed = between(1e-3, 1e3), g = (scene % 2 ? 1 : -1) * between(1e-4, 1e3);
        const Vec3d along = Vec3d(0.6, 0, -0.8);
        CAPTURE(k, c, t, speed, g);
        const State whole = after(speed * along, g * along, k, c, t);
        const State parts = after(speed * along, g * along, k, c, t, 7);
        // For accelerations far below the drag, the closed form loses a few digits.
        CHECK((whole.x - parts.x).norm() <= 1e-7 * parts.x.norm() + 1e-8 * speed / (k + c * speed));
        CHECK((whole.v - parts.v).norm() <= 1e-7 * parts.v.norm() + 1e-9 * speed);
    }
}

TEST_CASE("across an acceleration the error is of second order in the step", "[quadratic_drag]")
{
    const double k = GENERATE(0.0, 1.0, 5.0), c = GENERATE(0.3, 2.0);
    const Vec3d v(10, 3, 0), G = GENERATE(Vec3d(0, -9.81, 4), Vec3d(5, 0, -60));
    CAPTURE(k, c, G);
    const State exact = reference(v, G, k, c, 0.5);
    const auto error = [&](int steps) { return (after(v, G, k, c, 0.5, steps).x - exact.x).norm(); };
    CHECK(error(64) / error(128) == Approx(4).epsilon(0.1));
    CHECK(error(1) <= 0.25 * exact.x.norm());
}

TEST_CASE("no drag takes a point farther than less drag, or turns it round", "[quadratic_drag]")
{
    std::mt19937 random(5);
    std::uniform_real_distribution<> exponent(-6, 9);
    for (int scene = 0; scene < 20000; ++scene) {
        const double c = std::pow(10, exponent(random)), speed = std::pow(10, exponent(random) / 2);
        const double k = std::max(0.0, exponent(random)), t = 1.0 / 24;
        const Vec3d v(0, speed, 0);
        CAPTURE(c, speed, k);
        const State end = after(v, Vec3d::Zero(), k, c, t), less = after(v, Vec3d::Zero(), k, 0.5 * c, t);
        CHECK(end.x.y() <= less.x.y());
        CHECK(end.v.y() >= 0);
        CHECK(end.v.y() <= less.v.y());
    }
}

TEST_CASE("a dragged spring never gains energy", "[quadratic_drag]")
{
    std::mt19937 random(3);
    std::uniform_real_distribution<> exponent(-3, 4), coordinate(-1, 1);
    const auto any = [&] { return Vec3d(coordinate(random), coordinate(random), coordinate(random)); };
    for (int scene = 0; scene < 20000; ++scene) {
        Linear linear;
        linear.k = scene % 2 ? 0 : std::pow(10, exponent(random));
        linear.c = std::pow(10, exponent(random));
        linear.w2 = std::pow(10, exponent(random));
        const Vec3d P = any(), v = std::pow(10, exponent(random)) * any();
        CAPTURE(linear.k, linear.c, linear.w2, P, v);
        Responder responder;
        const Damped end = Damped::from(P, v, Vec3d::Zero(), linear, 1.0 / 24, responder);
        const auto energy = [&](const Vec3d& at, const Vec3d& speed) {
            return speed.squaredNorm() + linear.w2 * at.squaredNorm();
        };
        CHECK(energy(P + end.travel, end.v) <= energy(P, v) * (1 + 1e-12));
    }
}

TEST_CASE("a dragged spring is of second order, with linear drag too", "[quadratic_drag]")
{
    Linear linear;
    linear.k = GENERATE(0.0, 4.0);
    linear.c = 0.8;
    linear.w2 = 30;
    const auto run = [&](int steps) {
        Responder responder;
        Vec3d P(1, 0, 0), v(0, 6, -2);
        for (int step = 0; step < steps; ++step) {
            const Damped end = Damped::from(P, v, Vec3d::Zero(), linear, 0.5 / steps, responder);
            P += end.travel;
            v = end.v;
        }
        return P;
    };
    const Vec3d exact = run(16384);
    CHECK((run(64) - exact).norm() / (run(128) - exact).norm() == Approx(4).epsilon(0.15));
}

TEST_CASE("a fast point slides on a floor as far as its drag lets it", "[quadratic_drag]")
{
    struct Air : Force {
        double c;
        explicit Air(double coefficient) : c(coefficient) {}
        void contribute(const Chunk& chunk, Forces& forces) const override
        {
            for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_quadratic_drag(i, c);
        }
    };
    const auto [speed, c] = GENERATE(std::pair(300.0, 0.5), std::pair(5e5, 1e9));
    Scene scene{PointSet(test::points({{0, 0, 0}}).v({{static_cast<float>(speed), 0, 0}}))};
    scene.gravity().floor(0, 0);
    scene.dynamics.add(std::make_shared<Air>(c));
    const double distance = scene.run(1).P().x(), alone = std::log1p(c * speed / 24) / c;
    CHECK(distance <= alone * 1.001);
    CHECK(distance >= alone * (speed > 1000 ? 0.75 : 0.995));  // below terminal speed, it counts as falling
}

}  // namespace
}  // namespace rapid

// Points without a solution move as one rigid body.
#include "runtime/solver/constraints/rigid_fallback.h"

#include <rapidcheck.h>

#include <numeric>
#include <random>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "tests/test.h"

namespace rapid {
namespace {

struct Body {
    std::vector<ProjectedPoint> points;
    std::vector<Vec3d> v, start, displacement;
    std::vector<double> inverse_mass;
    std::vector<std::uint32_t> all;
    Substep step;

    // line: all points on one axis, about which there is no inertia.
    Body(unsigned seed, std::size_t n, bool line) : displacement(n, Vec3d::Zero()), all(n), random_(seed)
    {
        const Vec3d axis = any();
        for (std::size_t i = 0; i < n; ++i) {
            inverse_mass.push_back(std::pow(10, 2 * number_(random_)));
            v.push_back(any());
            start.push_back(line ? Vec3d(any()[0] * axis) : any());
            points.push_back({start[i] + 0.1 * any(), inverse_mass[i]});
        }
        std::iota(all.begin(), all.end(), 0u);
        step.points = points, step.v = v, step.start = start, step.displacement = displacement;
        step.inverse_mass = inverse_mass;
        step.dt = 0.1;
    }

    Vec3d any() { return {number_(random_), number_(random_), number_(random_)}; }
    // Sets the velocities of a rotation about the center.
    void turn(const Vec3d& omega)
    {
        for (const std::uint32_t i : all) v[i] = omega.cross(start[i] - mean(start));
    }
    double mass(std::size_t i) const { return 1 / inverse_mass[i]; }
    Vec3d mean(std::span<const Vec3d> values) const
    {
        Vec3d sum = Vec3d::Zero();
        double all_mass = 0;
        for (std::size_t i = 0; i < values.size(); ++i) sum += mass(i) * values[i], all_mass += mass(i);
        return sum / all_mass;
    }
    std::vector<Vec3d> positions() const
    {
        std::vector<Vec3d> P;
        for (const ProjectedPoint& point : points) P.push_back(point.P);
        return P;
    }
    Vec3d turning(const std::vector<Vec3d>& P) const
    {
        Vec3d sum = Vec3d::Zero();
        for (const std::uint32_t i : all) sum += mass(i) * (P[i] - mean(P)).cross(v[i]);
        return sum;
    }
    double kinetic() const
    {
        double sum = 0;
        for (const std::uint32_t i : all) sum += 0.5 * mass(i) * v[i].squaredNorm();
        return sum;
    }

private:
    std::mt19937 random_;
    std::uniform_real_distribution<double> number_{-1, 1};
};

TEST_CASE("a rigid fallback keeps distances and momenta, and gives no energy", "[rigid_fallback]")
{
    rc::prop("", [](unsigned seed, bool line) {
        Body body(seed, 2 + seed % 6, line);
        RigidFallback fallback;
        fallback.begin(body.step);
        const std::vector<Vec3d> start = body.start, free = body.positions();
        const Vec3d velocity = body.mean(body.v), turning = body.turning(start);
        const double before = body.kinetic();
        for (ProjectedPoint& point : body.points) point.P += 1e3 * body.any();
        for (Vec3d& v : body.v) v = 1e3 * body.any();
        fallback.apply(body.step, body.all, nullptr);
        const std::vector<Vec3d> P = body.positions();
        for (const std::uint32_t i : body.all)
            for (const std::uint32_t j : body.all)
                RC_ASSERT(std::abs((P[i] - P[j]).norm() - (start[i] - start[j]).norm()) <= 1e-12);
        RC_ASSERT((body.mean(P) - body.mean(free)).norm() <= 1e-12);
        RC_ASSERT((body.mean(body.v) - velocity).norm() <= 1e-12);
        RC_ASSERT((body.turning(P) - turning).norm() <= 1e-9 * (1 + turning.norm()));
        RC_ASSERT(body.kinetic() <= before * (1 + 1e-12));
    });
}

TEST_CASE("a rigid fallback loses nothing of a body that turns", "[rigid_fallback]")
{
    Body body(1, 5, false);
    body.turn({1, -2, 3});
    RigidFallback fallback;
    fallback.begin(body.step);
    const std::vector<Vec3d> v = body.v;
    fallback.apply(body.step, body.all, nullptr);
    for (const std::uint32_t i : body.all) CHECK((body.v[i] - v[i]).norm() <= 1e-12);
}

TEST_CASE("what is linked to a point at rest, or drawn to a place, stays where it was", "[rigid_fallback]")
{
    const bool drawn = GENERATE(false, true);
    Body body(3, 4, false);
    std::vector<Mobility> mobility(4, {0.1, 0.005});
    const std::vector<SurfaceSpring> none(4);
    if (drawn) {
        mobility[2].stiffness = 10;
        body.step.mobility = mobility;
        body.step.surface_springs = none;
    }
    RigidFallback fallback;
    fallback.begin(body.step);
    const std::vector<Vec3d> start = body.start;
    const Drive at_rest;
    fallback.apply(body.step, body.all, drawn ? nullptr : &at_rest);
    CHECK(body.positions() == start);
    CHECK(body.kinetic() == 0);
}

static void give_up(Body& body)
{
    RigidFallback fallback;
    fallback.begin(body.step);
    fallback.apply(body.step, body.all, nullptr);
}

TEST_CASE("a body without a solution goes along with the surfaces that draw it, by their stiffness", "[rigid_fallback]")
{
    Body body(3, 4, false);
    const std::vector<Mobility> mobility(4, {0.1, 0.005});
    const Vec3d V(3, -2, 5);
    const MotionPtr motion = keyed_motion({{0, {}}, {1, {V}}});
    const ShapePtr rest = make_sphere_shape(0.3, Vec3d::Zero()), moves = moving(rest, *motion, {1, 0}, 0, 1);
    std::vector<SurfaceSpring> springs(4);
    springs[1] = {3 * body.inverse_mass[1], moves.get(), 0.5};
    const bool both = GENERATE(false, true);
    if (both) springs[2] = {1 * body.inverse_mass[2], rest.get(), 0.5};
    body.step.mobility = mobility;
    body.step.surface_springs = springs;
    const std::vector<Vec3d> start = body.start;
    give_up(body);
    const Vec3d by = both ? Vec3d(0.75 * V) : V;
    for (const std::uint32_t i : body.all) {
        CHECK_THAT(body.positions()[i], test::close_to(Vec3d(start[i] + 0.1 * by), 1e-12));
        CHECK_THAT(body.v[i], test::close_to(by, 1e-12));
    }
}

class Falling : public Motion {
public:
    explicit Falling(const Vec3d& a) : a_(a) {}
    Pose at(const Frame& frame) const override { return {0.5 * frame.time * frame.time * a_}; }
    FrameRange range() const override { return {0, 1}; }

private:
    Vec3d a_;
};

TEST_CASE("a body without a solution goes as a surface that accelerates and draws it", "[rigid_fallback]")
{
    Body body(3, 4, false);
    const std::vector<Mobility> mobility(4, {0.1, 0.005});
    const Vec3d a(3, -2, 5);
    const ShapePtr falls = moving(make_sphere_shape(0.3, Vec3d::Zero()), Falling(a), {1, 0}, 0, 1);
    const std::vector<SurfaceSpring> springs(4, {1, falls.get(), 0.5});  // at the end of a substep of 0.1 s
    body.step.mobility = mobility;
    body.step.surface_springs = springs;
    const std::vector<Vec3d> start = body.start;
    give_up(body);
    for (const std::uint32_t i : body.all) {
        CHECK_THAT(body.positions()[i], test::close_to(Vec3d(start[i] + 0.5 * (0.25 - 0.16) * a), 1e-6));
        CHECK_THAT(body.v[i], test::close_to(Vec3d(0.5 * a), 1e-6));
    }
}

TEST_CASE("a body without a solution moves with its driver", "[rigid_fallback]")
{
    Body body(3, 5, false);
    RigidFallback fallback;
    fallback.begin(body.step);
    const std::vector<Vec3d> start = body.start;
    const Drive by{{1, 2, 3}, {0.1, 0, -0.2}};
    fallback.apply(body.step, body.all, &by);
    for (const std::uint32_t i : body.all) {
        CHECK(body.positions()[i] == start[i] + by.displacement);
        CHECK(body.v[i] == by.v);
    }
}

}  // namespace
}  // namespace rapid

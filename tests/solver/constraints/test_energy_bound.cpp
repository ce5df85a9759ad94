// The energy bound, for any result of constraints in velocities and positions.
#include <rapidcheck.h>

#include <cmath>
#include <numeric>
#include <random>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/motion/moving.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "tests/test.h"

namespace rapid {
namespace {

// Points in free space, of random masses and velocities; links between neighbours in pairs.
struct FoundPairs {
    std::vector<ProjectedPoint> points;
    std::vector<Vec3d> v, start, displacement;
    std::vector<double> inverse_mass;
    Substep step;

    explicit FoundPairs(unsigned seed, std::size_t n = 8) : random_(seed)
    {
        for (std::size_t i = 0; i < n; ++i) {
            const double w = std::pow(10, 3 * number_(random_));
            points.push_back({any(), w});
            v.push_back(any());
            start.push_back(points[i].P);
            inverse_mass.push_back(w);
            displacement.push_back(Vec3d::Zero());
        }
        step.points = points, step.v = v, step.start = start, step.inverse_mass = inverse_mass;
        step.acceleration = {0, -10, 0};
        step.dt = 0.01;
    }

    Vec3d any() { return {number_(random_), number_(random_), number_(random_)}; }
    // Applies an impulse between the two points of each pair, and a shift of both.
    void push(double size, double shift)
    {
        for (std::size_t i = 0; i + 1 < v.size(); i += 2) {
            const Vec3d p = size * any(), d = shift * any();
            v[i] += points[i].w * p, v[i + 1] -= points[i + 1].w * p;
            points[i].P += points[i].w * d, points[i + 1].P -= points[i + 1].w * d;
        }
    }
    double energy(std::size_t pair) const
    {
        double sum = 0;
        for (const std::size_t i : {pair, pair + 1})
            sum += (0.5 * v[i].squaredNorm() - step.acceleration.dot(points[i].P)) / inverse_mass[i];
        return sum;
    }
    Vec3d momentum(std::size_t pair) const
    {
        return v[pair] / inverse_mass[pair] + v[pair + 1] / inverse_mass[pair + 1];
    }

    ContactEnergy close(EnergyBound& bound, const RigidFallback* fallback = nullptr)
    {
        const auto link = [&](EnergyIslands& islands) {
            for (std::uint32_t i = 0; i + 1 < v.size(); i += 2) islands.link(std::array{i, i + 1});
        };
        return bound.close(step, nothing, link, fallback);
    }
    static void nothing(double, std::span<double>) {}

private:
    std::mt19937 random_;
    std::uniform_real_distribution<double> number_{-1, 1};
};

TEST_CASE("no pair has more energy than before, but for what is told, and each keeps its momentum", "[energy_bound]")
{
    rc::prop("", [](unsigned seed) {
        FoundPairs pairs(seed);
        EnergyBound bound;
        bound.begin(pairs.step, FoundPairs::nothing);
        std::vector<double> before;
        std::vector<Vec3d> momentum;
        for (std::size_t i = 0; i < pairs.v.size(); i += 2)
            before.push_back(pairs.energy(i)), momentum.push_back(pairs.momentum(i));
        pairs.push(3, *rc::gen::elementOf(std::vector<double>{0, 1e-3, 1}));
        const double reported = pairs.close(bound).added;
        double gained = 0;
        for (std::size_t i = 0; i < pairs.v.size(); i += 2) {
            gained += std::max(0.0, pairs.energy(i) - before[i / 2]);
            RC_ASSERT((pairs.momentum(i) - momentum[i / 2]).norm() <= 1e-9 * (1 + momentum[i / 2].norm() + 3));
        }
        RC_ASSERT(gained <= reported + 1e-9 * (1 + reported));
    });
}

TEST_CASE("a change that takes energy stays as it is, and is told", "[energy_bound]")
{
    FoundPairs pairs(1, 2);
    EnergyBound bound;
    bound.begin(pairs.step, FoundPairs::nothing);
    const double before = pairs.energy(0);
    const Vec3d mean = pairs.momentum(0) / (1 / pairs.inverse_mass[0] + 1 / pairs.inverse_mass[1]);
    pairs.v[0] = pairs.v[1] = mean;
    const ContactEnergy reported = pairs.close(bound);
    CHECK(pairs.v[0] == mean);
    CHECK(reported.added == 0);
    CHECK(reported.lost == Approx(before - pairs.energy(0)));
}

TEST_CASE("a pair that corrections of positions lift out of all proportion moves as a rigid body", "[energy_bound]")
{
    FoundPairs pairs(1, 4);
    pairs.step.displacement = pairs.displacement;
    EnergyBound bound;
    bound.begin(pairs.step, FoundPairs::nothing);
    RigidFallback fallback;
    fallback.begin(pairs.step);
    const double before = pairs.energy(0), length = (pairs.start[0] - pairs.start[1]).norm();
    const Vec3d momentum = pairs.momentum(0), other = pairs.points[2].P;
    for (int i : {0, 1}) pairs.points[i].P += Vec3d(0, 1e6, 0);
    const ContactEnergy reported = pairs.close(bound, &fallback);
    REQUIRE(bound.stalled().size() == 4);
    CHECK((bound.stalled()[0] && bound.stalled()[1] && !bound.stalled()[2] && !bound.stalled()[3]));
    CHECK(reported.added == 0);
    CHECK(pairs.energy(0) <= before + 1e-12 * std::abs(before));
    CHECK((pairs.momentum(0) - momentum).norm() <= 1e-12 * momentum.norm());
    CHECK((pairs.points[0].P - pairs.points[1].P).norm() == Approx(length));
    CHECK(pairs.points[2].P == other);
}

// A gain of 0.8 of the spring's initial energy is less than half of its energy afterwards, which was not available.
TEST_CASE("a pair that corrections of positions move farther off what a spring draws it to has no solution",
          "[energy_bound]")
{
    FoundPairs pairs(1, 2);
    pairs.step.displacement = pairs.displacement;
    std::vector<Mobility> mobility(2, {0.01, 5e-5});
    const ShapePtr sphere = make_sphere_shape(0.3, Vec3d::Zero());
    std::vector<SurfaceSpring> springs(2);
    const bool of_surface = GENERATE(false, true);
    if (of_surface)
        springs[0] = {1e4, sphere.get(), 0};
    else
        mobility[0].stiffness = 1e4;
    pairs.points[0].P = pairs.start[0] = Vec3d(0, of_surface ? 0.4 : 0.1, 0);
    pairs.v.assign(2, Vec3d::Zero());
    pairs.step.mobility = mobility, pairs.step.surface_springs = springs;
    EnergyBound bound;
    bound.begin(pairs.step, FoundPairs::nothing);
    RigidFallback fallback;
    fallback.begin(pairs.step);
    pairs.points[0].P.y() += (std::sqrt(1.8) - 1) * 0.1;
    const ContactEnergy reported = pairs.close(bound, &fallback);
    REQUIRE(bound.stalled().size() == 2);
    CHECK(reported.added <= 1e-12);
    for (std::size_t i : {0, 1}) CHECK(pairs.points[i].P == pairs.start[i]);
}

TEST_CASE("a pair without a solution, one of whose points a place holds, stays where it was", "[energy_bound]")
{
    FoundPairs pairs(1, 2);
    pairs.step.displacement = pairs.displacement;
    EnergyBound bound;
    bound.begin(pairs.step, FoundPairs::nothing);
    RigidFallback fallback;
    fallback.begin(pairs.step);
    for (ProjectedPoint& point : pairs.points) point.P += Vec3d(0, 1e6, 0);
    const auto link = [](EnergyIslands& islands) {
        islands.link(std::array{0u, 1u});
        islands.drive(1u, {});
    };
    bound.close(pairs.step, FoundPairs::nothing, link, &fallback);
    for (std::size_t i : {0, 1}) {
        CHECK(pairs.points[i].P == pairs.start[i]);
        CHECK(pairs.v[i].isZero(0));
    }
}

// The second point of each pair moves by itself, with an acceleration.
TEST_CASE("what a point drives has no more energy than before, as it is seen from there", "[energy_bound]")
{
    rc::prop("", [](unsigned seed) {
        FoundPairs pairs(seed);
        std::vector<Vec3d> A(pairs.v.size(), Vec3d::Zero());
        for (std::size_t i = 1; i < pairs.v.size(); i += 2) {
            A[i - 1] = 100 * pairs.any();
            pairs.points[i].w = 0;
        }
        const auto seen = [&](std::size_t i) {
            const Vec3d v = pairs.v[i] - pairs.v[i + 1], a = pairs.step.acceleration - A[i];
            return (0.5 * v.squaredNorm() - a.dot(pairs.points[i].P)) / pairs.inverse_mass[i];
        };
        EnergyBound bound;
        bound.begin(pairs.step, FoundPairs::nothing);
        std::vector<double> before;
        for (std::size_t i = 0; i < pairs.v.size(); i += 2) before.push_back(seen(i));
        const double shift = *rc::gen::elementOf(std::vector<double>{0, 1e-3});
        std::vector<Vec3d> v(pairs.v);
        pairs.push(3, shift);
        for (std::size_t i = 1; i < pairs.v.size(); i += 2) pairs.v[i] = v[i];  // follows its own motion
        const std::vector<Vec3d> pushed(pairs.v);
        const double dt = pairs.step.dt;
        const auto link = [&](EnergyIslands& islands) {
            for (std::uint32_t i = 0; i < pairs.v.size(); i += 2) {
                islands.link(std::array{i, i + 1});
                islands.move(i + 1, Drive::of(v[i + 1] - dt * A[i], v[i + 1], dt));
            }
        };
        bound.close(pairs.step, FoundPairs::nothing, link, nullptr);
        for (std::size_t i = 0; i < pairs.v.size(); i += 2) {
            const double rounding = 1e-9 * (1 + std::abs(before[i / 2]));
            if (seen(i) <= before[i / 2] + rounding) continue;
            // If the shift has raised it: the minimum on the line from the old velocity to the new one.
            RC_ASSERT(shift > 0);
            const Vec3d change = pushed[i] - v[i], u = v[i] - v[i + 1];
            const double t = std::clamp(-u.dot(change) / change.squaredNorm(), 0.0, 1.0);
            RC_ASSERT((pairs.v[i] - (v[i] + t * change)).norm() <= 1e-9 * (1 + change.norm()));
        }
    });
}

TEST_CASE("what two points drive apart has no more than a wall of their speed would give", "[energy_bound]")
{
    rc::prop("", [](unsigned seed) {
        FoundPairs pairs(seed, 3);
        pairs.step.acceleration.setZero();
        double spread = 0;
        for (const std::size_t i : {1, 2}) {
            pairs.points[i].w = 0;
            pairs.start[i] = pairs.points[i].P - pairs.step.dt * pairs.v[i];
            spread = 0.5 * (pairs.v[1] - pairs.v[2]).norm();
        }
        const Vec3d mean = 0.5 * (pairs.v[1] + pairs.v[2]);
        const double before = (pairs.v[0] - mean).norm();
        EnergyBound bound;
        bound.begin(pairs.step, FoundPairs::nothing);
        pairs.v[0] += 1e3 * pairs.any();
        const auto link = [](EnergyIslands& islands) {
            islands.link(std::array{0u, 1u});
            islands.link(std::array{0u, 2u});
        };
        bound.close(pairs.step, FoundPairs::nothing, link, nullptr);
        RC_ASSERT((pairs.v[0] - mean).norm() <= before + 2 * spread + 1e-9);
    });
}

}  // namespace

// Points without a solution move as one rigid body.

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

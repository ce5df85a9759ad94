#include "runtime/solver/constraints/pile_substeps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/test.h"

namespace rapid {
namespace {

constexpr double frame_length = 1.0 / 24, r = 0.02, standard_g = 9.81;  // s, m, m/s²
const Vec3d gravity(0, -standard_g, 0);

// Grains at rest, each on the one before it.
struct Stack {
    std::vector<float> radii, masses;
    Vec3d up = Vec3d::UnitY();

    explicit Stack(std::size_t count, double radius = r) : radii(count, static_cast<float>(radius)), masses(count, 1.0f)
    {
    }

    PointSet points() const
    {
        PointSet set;
        set.append(radii.size());
        const std::span<Vec3f> P = set.P().write();
        double height = 0;
        for (std::size_t i = 0; i < radii.size(); ++i) {
            P[i] = ((height + double(radii[i])) * up).cast<float>();
            height += 2.0 * double(radii[i]);
        }
        set.add({"mass", 1.0f});
        std::copy(masses.begin(), masses.end(), set.column<float>("mass").write().begin());
        return set;
    }
    double needed(const Vec3d& acceleration = gravity, double frame = frame_length, bool loads_add_up = true) const
    {
        return pile_substeps(points(), radii, acceleration, frame, loads_add_up);
    }
};

}  // namespace

TEST_CASE("a stack of N grains needs h sqrt(12 N g/r) substeps", "[contacts]")
{
    for (const std::size_t count : {1u, 4u, 10u, 100u})
        CHECK(Stack(count).needed() ==
              Approx(frame_length * std::sqrt(12 * double(count) * standard_g / r)).epsilon(1e-6));
    const double ten = Stack(10).needed();
    CHECK(Stack(10).needed(4 * gravity) == Approx(2 * ten).epsilon(1e-6));
    CHECK(Stack(10).needed(gravity, 3 * frame_length) == Approx(3 * ten).epsilon(1e-6));
    CHECK(Stack(10, r / 16).needed() == Approx(4 * ten).epsilon(1e-6));
    CHECK(Stack(10, 1e6 * r).needed() == 1);
}

TEST_CASE("a light grain under a heavy one needs substeps by the root of the mass on it", "[contacts]")
{
    const double one = Stack(1).needed();
    Stack stack(2);
    stack.masses = {1, 99};
    CHECK(stack.needed() == Approx(10 * one).epsilon(1e-6));
    stack.masses = {99, 1};
    CHECK(stack.needed() == Approx(std::sqrt(100.0 / 99) * one).epsilon(1e-6));
    stack.masses = {7, 7};
    CHECK(stack.needed() == Approx(std::sqrt(2.0) * one).epsilon(1e-6));
}

TEST_CASE("with mass scaling a grain carries only itself", "[contacts]")
{
    CHECK(Stack(100).needed(gravity, frame_length, false) == Approx(Stack(1).needed()).epsilon(1e-6));
}

TEST_CASE("a small grain near a large one needs the substeps of a small grain", "[contacts]")
{
    Stack stack(1);
    stack.radii.push_back(static_cast<float>(r / 100));
    stack.masses = {1, 1e-6f};
    PointSet points = stack.points();
    points.P().write()[1] = Vec3f(1, 0, 0);
    CHECK(pile_substeps(points, stack.radii, gravity, frame_length) ==
          Approx(Stack(1, r / 100).needed()).epsilon(1e-6));
}

TEST_CASE("stacks that stand apart do not load each other", "[contacts]")
{
    const Stack stack(20);
    PointSet points = stack.points();
    const std::span<Vec3f> P = points.P().write();
    for (std::size_t i = 10; i < 20; ++i) P[i] += Vec3f(1, static_cast<float>(-20 * r), 0);
    CHECK(pile_substeps(points, stack.radii, gravity, frame_length) == Approx(Stack(10).needed()).epsilon(1e-6));
}

TEST_CASE("the direction of gravity and the order of the points do not change their substeps", "[contacts]")
{
    Stack stack(8);
    stack.masses = {1, 2, 3, 4, 5, 6, 7, 8};
    const double needed = stack.needed();
    const PointSet points = stack.points();
    std::vector<std::uint32_t> backwards;
    for (std::uint32_t i = 8; i-- > 0;) backwards.push_back(i);
    CHECK(pile_substeps(points.select(backwards), stack.radii, gravity, frame_length) == needed);
    for (const Vec3d& up : {Vec3d(1, 0, 0), Vec3d(Vec3d(1, 2, -2) / 3)}) {
        stack.up = up;
        CHECK(stack.needed(-standard_g * up) == Approx(needed).epsilon(1e-6));
    }
}

TEST_CASE("99 of 100 grains move by at most half of their radius in a substep", "[contacts]")
{
    const Stack stack(200);
    PointSet points = stack.points();
    points.v().fill(Vec3f(0, 0, static_cast<float>(30 * r / frame_length)));
    const std::span<Vec3f> v = points.v().write();
    v[3] *= 100;
    CHECK(pile_substeps(points, stack.radii, Vec3d::Zero(), frame_length) == Approx(60).epsilon(1e-6));
    v[4] *= 2, v[5] *= 2;
    CHECK(pile_substeps(points, stack.radii, Vec3d::Zero(), frame_length) == Approx(120).epsilon(1e-6));
}

TEST_CASE("points without contacts, of infinite mass or without a finite position need one substep", "[contacts]")
{
    const Stack stack(10);
    CHECK(pile_substeps(stack.points(), std::vector<float>(10, 0.0f), gravity, frame_length) == 1);
    CHECK(pile_substeps(PointSet(), {}, gravity, frame_length) == 1);
    CHECK(stack.needed(Vec3d::Zero()) == 1);
    PointSet points = stack.points();
    points.column<float>("mass").fill(std::numeric_limits<float>::infinity());
    CHECK(pile_substeps(points, stack.radii, gravity, frame_length) == 1);
    points = stack.points();
    points.P().write()[9] = Vec3f::Constant(std::numeric_limits<float>::quiet_NaN());
    CHECK(pile_substeps(points, stack.radii, gravity, frame_length) == Approx(Stack(9).needed()).epsilon(1e-6));
}

}  // namespace rapid

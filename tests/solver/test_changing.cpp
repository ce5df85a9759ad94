#include "runtime/solver/changing.h"

#include "tests/test.h"

namespace rapid {
namespace {

// A wind, a spring and a push along x of this size, for each point.
class Number : public Force {
public:
    explicit Number(double x) : x_(x) {}
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            forces.add(i, Vec3d(x_, 0, 0));
            forces.add_drag(i, 2, Vec3d(x_, 0, 0));
            forces.add_spring(i, 3, Vec3d(0, x_, 0));
            forces.add_quadratic_drag(i, 4);
        }
    }

private:
    double x_;
};

class Wind : public Force {
public:
    explicit Wind(double x) : x_(x) {}
    void contribute(const Chunk&, Forces&) const override {}
    std::optional<Uniform> uniform() const override
    {
        Uniform wind{Vec3d(x_, 0, 0)};
        wind.linear.k = x_;
        return wind;
    }

private:
    double x_;
};

std::vector<std::shared_ptr<const Force>> numbers(int count)
{
    std::vector<std::shared_ptr<const Force>> list;
    for (int k = 0; k < count; ++k) list.push_back(std::make_shared<Number>(k));
    return list;
}

}  // namespace

TEST_CASE("each point has the force of the time that is nearest to its own", "[timed_force]")
{
    // The forces are 0 at 10 s, 1 at 10.5 s, 2 at 11 s.
    const TimedForce force(numbers(3), 10, 1, Vec3d(0, 5, 0));
    const std::vector<double> time = {10, 10.2, 10.3, 10.7, 10.8, 10.5, 10.5, 12, 9};
    const std::vector<double> expected = {0, 0, 1, 1, 2, 1, 1, 2, 0};
    PointSet points;
    points.append(time.size());
    std::vector<Vec3d> P(time.size(), Vec3d::Zero()), v = P;
    const std::vector<double> dt(time.size(), 0.1);
    Forces forces;
    forces.reset(time.size());
    force.contribute({points, 0, P, v, dt, time, 0}, forces);
    for (std::size_t i = 0; i < time.size(); ++i) {
        CHECK(forces.acceleration(i).isApprox(Vec3d(expected[i], -5, 0)));
        CHECK(forces.linear(i).ku.isApprox(Vec3d(2 * expected[i], 0, 0)));
        CHECK(forces.linear(i).w2q.isApprox(Vec3d(0, 3 * expected[i], 0)));
        CHECK(forces.linear(i).k == 2);
        CHECK(forces.linear(i).w2 == 3);
        CHECK(forces.linear(i).c == 4);
    }
}

TEST_CASE("a force that changes in time has no potential", "[timed_force]")
{
    const TimedForce force(numbers(3), 0, 1, Vec3d::Zero());
    PointSet points;
    points.append(1);
    std::vector<Vec3d> P(1, Vec3d::Zero());
    const std::vector<double> one(1, 0.5);
    std::vector<double> energy(1, 0);
    CHECK(!force.add_potential({points, 0, P, P, one, one, 0}, energy));
    CHECK(!force.uniform());
    CHECK(!force.uniform_at(0.5));
}

TEST_CASE("a force that is uniform at each time is reported as uniform", "[timed_force]")
{
    std::vector<std::shared_ptr<const Force>> winds;
    for (int k = 0; k < 3; ++k) winds.push_back(std::make_shared<Wind>(k));
    const TimedForce force(winds, 0, 1, Vec3d(0, 5, 0));
    CHECK(force.uniform_at(0.4)->a == Vec3d(1, -5, 0));
    CHECK(force.uniform_at(0.9)->linear.k == 2);
}

}  // namespace rapid

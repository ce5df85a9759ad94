// The linear system of rows in nets: the solution equals that of a dense solver, and no iterate does work.
#include <Eigen/Dense>

#include <random>

#include "runtime/solver/constraints/system_motion.h"
#include "tests/test.h"

namespace rapid {
namespace {

constexpr std::size_t point_count = 12, rows = 20, arity = 2;

// Random rows over pairs of points, with masses over three decades.
struct RandomRows {
    RowSystem system;
    RowSchedule schedule;

    RandomRows(unsigned seed, double compliance)
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> number(-1, 1);
        system.begin(rows, arity, point_count);
        std::vector<std::uint32_t> numbers(rows);
        for (std::uint32_t r = 0; r < rows; ++r) {
            numbers[r] = r;
            const auto first = static_cast<std::uint32_t>(random() % point_count);
            system.points[r * arity] = first;
            system.points[r * arity + 1] =
                static_cast<std::uint32_t>((first + 1 + random() % (point_count - 1)) % point_count);
            for (std::size_t k = 0; k < arity; ++k)
                system.gradient[r * arity + k] = Vec3d(number(random), number(random), number(random));
            system.e[r] = number(random);
            system.s[r] = compliance;
        }
        for (double& w : system.w) w = std::pow(10, 1.5 * number(random));
        schedule = RowSchedule(numbers, system.points, arity, std::vector<std::uint8_t>(point_count), false);
    }

    Eigen::MatrixXd matrix() const
    {
        Eigen::MatrixXd G = Eigen::MatrixXd::Zero(rows, 3 * point_count);
        Eigen::VectorXd w(3 * point_count);
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t k = 0; k < arity; ++k)
                G.block<1, 3>(static_cast<Eigen::Index>(r), 3 * system.points[r * arity + k]) +=
                    system.gradient[r * arity + k].transpose();
        for (std::size_t i = 0; i < point_count; ++i)
            w.segment<3>(static_cast<Eigen::Index>(3 * i)).setConstant(system.w[i]);
        Eigen::MatrixXd A = G * w.asDiagonal() * G.transpose();
        for (std::size_t r = 0; r < rows; ++r) {
            const auto i = static_cast<Eigen::Index>(r);
            A(i, i) += system.s[r];
        }
        return A;
    }
};

TEST_CASE("a system of rows has the solution of a dense solver", "[constraints]")
{
    const unsigned seed = GENERATE(range(1u, 20u));
    RandomRows random(seed, 0.1);
    random.system.solve(random.schedule, 1e-12, 500);
    const Eigen::VectorXd exact =
        random.matrix().ldlt().solve(-Eigen::Map<const Eigen::VectorXd>(random.system.e.data(), rows));
    for (std::size_t r = 0; r < rows; ++r)
        CHECK(random.system.lambda[r] ==
              Approx(exact(static_cast<Eigen::Index>(r))).margin(1e-8 * exact.cwiseAbs().maxCoeff()));
}

TEST_CASE("however few the iterations, what a system of rows has found does no work", "[constraints]")
{
    const unsigned seed = GENERATE(range(1u, 10u));
    const int iterations = GENERATE(1, 2, 3, 7);
    const bool begins_elsewhere = GENERATE(false, true);
    CAPTURE(seed, iterations, begins_elsewhere);
    RandomRows random(seed, 0);
    for (std::size_t r = 0; begins_elsewhere && r < rows; ++r)
        random.system.lambda[r] = std::sin(static_cast<double>(r));
    random.system.solve(random.schedule, 0, iterations);
    const Eigen::Map<const Eigen::VectorXd> lambda(random.system.lambda.data(), rows), e(random.system.e.data(), rows);
    const Eigen::VectorXd load = random.matrix() * lambda;
    REQUIRE(lambda.norm() > 0);
    CHECK(lambda.dot(load + e) == Approx(0).margin(1e-11 * (lambda.norm() * (load.norm() + e.norm()))));
}

}  // namespace
}  // namespace rapid

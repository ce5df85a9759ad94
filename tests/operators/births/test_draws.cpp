// Vectors turned within a cone.
#include "runtime/operators/births/draws.h"

#include <numbers>
#include <random>

#include "tests/test.h"

using namespace rapid;

namespace {

struct Case {
    std::vector<Vec3d> vectors;
    std::vector<Draws> draws;
};

Case random_case(std::size_t size)
{
    std::mt19937_64 engine(5);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal;
    Case result;
    for (std::size_t i = 0; i < size; ++i) {
        result.vectors.emplace_back(normal(engine), normal(engine), normal(engine));
        result.draws.push_back({uniform(engine), uniform(engine), uniform(engine), uniform(engine)});
    }
    return result;
}

}  // namespace

TEST_CASE("a turned vector keeps its length, and 1 - cos of its turn is the part of the cone's that is drawn", "[cone]")
{
    for (const double half_angle : {1e-6, 0.3, std::numbers::pi / 2, std::numbers::pi}) {
        const auto [before, draws] = random_case(1000);
        std::vector<Vec3d> after = before;
        Cone(half_angle).turn(after, draws);
        const double depth = 2 * std::pow(std::sin(half_angle / 2), 2);
        for (std::size_t i = 0; i < before.size(); ++i) {
            INFO(half_angle << ", " << i);
            CHECK(after[i].norm() == Approx(before[i].norm()).epsilon(1e-14));
            // |a - b|² = 2 (1 - cos) for unit vectors, which keeps the digits of a small turn.
            const double fall = 0.5 * (after[i] / before[i].norm() - before[i].normalized()).squaredNorm();
            CHECK(fall ==
                  Approx(depth * draws[i][cone_draw]).epsilon(1e-14).margin(1e-15 * std::sqrt(depth) + 1e-16 * depth));
            // The direction of the turn: around the vector, by turn_draw of a whole turn, from the x axis towards the
            // y axis.
            const Vec3d d = before[i].normalized();
            const double sign = std::copysign(1.0, d.z()), a = -1 / (sign + d.z());
            const Vec3d e1(1 + sign * d.x() * d.x() * a, sign * d.x() * d.y() * a, -sign * d.x());
            const Vec3d aside = after[i] - after[i].dot(d) * d;
            const double angle = std::atan2(aside.dot(d.cross(e1)), aside.dot(e1)) / (2 * std::numbers::pi);
            const double around = angle - draws[i][turn_draw];
            CHECK(std::abs(around - std::round(around)) < 1e-8);
        }
    }
}

TEST_CASE("a vector is turned in the same way alone and among others", "[cone]")
{
    const Cone cone(0.7);
    auto [all, draws] = random_case(21);
    all[13] = Vec3d(0, 0, -1);
    const std::vector<Vec3d> before = all;
    cone.turn(all, draws);
    for (std::size_t i = 0; i < all.size(); ++i) {
        std::vector<Vec3d> one{before[i]};
        cone.turn(one, std::span(draws).subspan(i, 1));
        CHECK(one[0] == all[i]);
    }
}

TEST_CASE("a vector of no length stays one", "[cone]")
{
    auto [vectors, draws] = random_case(9);
    vectors[3] = Vec3d::Zero();
    Cone(1).turn(vectors, draws);
    CHECK(vectors[3] == Vec3d::Zero());
    for (std::size_t i = 0; i < vectors.size(); ++i) CHECK(vectors[i].allFinite());
}

#include "runtime/operators/solve/aging.h"

#include <cmath>

#include "tests/operators/node_test.h"

namespace rapid {
namespace {

using test::NodeTest;

constexpr double frame_rates[] = {24, 25, 30, 60, 120, 24000.0 / 1001, 30000.0 / 1001, 7.3, 1};

// Returns the distance from a float to the next.
double step_at(float value) { return static_cast<double>(std::nextafter(value, 1e30f)) - static_cast<double>(value); }

TEST_CASE("an age of whole frames is their count by the rate, rounded once", "[aging]")
{
    for (const double fps : frame_rates) {
        const Aging aging(1 / fps);
        float age = 0;
        for (int frame = 1; frame <= 100000; ++frame) {
            age = aging.after_frame(age);
            if (age != static_cast<float>(frame / fps)) {  // a million CHECKs would take longer than everything else
                CAPTURE(fps, frame);
                REQUIRE(age == static_cast<float>(frame / fps));
            }
        }
    }
}

TEST_CASE("any other age stays within four steps of a float of where it should be", "[aging]")
{
    rc::prop("for any birth in the frame, over 5,000 frames", [] {
        const double fps = *rc::gen::elementOf(std::vector<double>(std::begin(frame_rates), std::end(frame_rates)));
        const float born = static_cast<float>(*rc::gen::inRange(0, 1 << 20)) / static_cast<float>(fps * (1 << 20));
        const Aging aging(1 / fps);
        float age = born;
        for (int frame = 1; frame <= 5000; ++frame) {
            age = aging.after_frame(age);
            RC_ASSERT(std::abs(double(age) - (double(born) + frame / fps)) <= 4.5 * step_at(age));
        }
    });
}

TEST_CASE("an age grows from anywhere, below 0 and beyond what frames can count", "[aging][extreme]")
{
    const Aging aging(1.0 / 24);
    CHECK(aging.after_frame(-1.0f) == static_cast<float>(-23.0 / 24));
    CHECK(aging.after_frame(static_cast<float>(-1.0 / 24)) == 0);
    CHECK(aging.after_frame(1e30f) == 1e30f);
    CHECK(aging.after_frame(std::numeric_limits<float>::infinity()) == std::numeric_limits<float>::infinity());
    CHECK(aging.after_frame(1e-30f) == static_cast<float>(1.0 / 24));
    CHECK(Aging(1e-12).after_frame(0) == 1e-12f);
    CHECK(Aging(1e12).after_frame(0) == 1e12f);
}

// Simulates points of which the first lives one frame, the second two, ...; returns the deaths in each frame.
std::vector<std::uint64_t> deaths(double fps, std::size_t frames, float age, bool own_dt)
{
    std::vector<float> lives;
    for (std::size_t n = 1; n <= frames; ++n) lives.push_back(static_cast<float>(double(n) / fps));
    PointSet points = test::points_at(std::vector<Vec3f>(frames, Vec3f::Zero()));
    points.add({"age", age});
    points.set("life", Column<float>(std::span<const float>(lives)));
    NodeTest solve("solve", {}, test::simulation(fps));
    std::vector<std::uint64_t> died;
    for (std::size_t f = 1; f <= frames; ++f) {
        if (own_dt) points.add({"dt", static_cast<float>(1 / fps)});  // like an emitter's newborn points
        solve.figures.died = 0;
        points = solve(static_cast<std::int64_t>(f) + 1, std::move(points));
        died.push_back(solve.figures.died);
    }
    return died;
}

TEST_CASE("a life of n frames ends with the n-th, for n from 1 to 2,000", "[aging]")
{
    for (const double fps : {24.0, 25.0, 30000.0 / 1001}) {
        CAPTURE(fps);
        CHECK(deaths(fps, 2000, 0, false) == std::vector<std::uint64_t>(2000, 1));
        CHECK(deaths(fps, 2000, 0, true) == std::vector<std::uint64_t>(2000, 1));
    }
}

TEST_CASE("a point born within a frame has outlived n frames' life in its n-th frame after that", "[aging]")
{
    // Points start half a frame old: (k + 1/2) h >= n h first holds for k = n.
    CHECK(deaths(24, 2000, 0.5f / 24, false) == std::vector<std::uint64_t>(2000, 1));
}

}  // namespace
}  // namespace rapid

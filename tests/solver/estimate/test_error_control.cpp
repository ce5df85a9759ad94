// The check of a tolerance: errors that doubling does not find, its timing, and its cost.
#include "runtime/solver/estimate/error_control.h"

#include <atomic>
#include <cmath>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::Scene;

constexpr double tolerance = 1e-4;
constexpr int most = 1024;

PointSet line_of(std::size_t n)
{
    std::vector<Vec3f> positions;
    for (std::size_t i = 0; i < n; ++i) positions.emplace_back(1e-4f * static_cast<float>(i), 0, 0);
    return test::points(positions);
}

// Number of times that points were queried for their force.
struct Work {
    std::uint64_t in_run = 0, in_check = 0;
};

// Runs one step of a scene like Solve; the sample holds the points that would have shadows. Returns the number of
// points beyond the tolerance.
std::uint64_t step(Scene& scene, ToleranceCheck& check, const std::atomic<std::uint64_t>& queries, Work& work)
{
    std::vector<std::uint32_t> chosen;
    for (std::size_t k = 0; k < scene.points.size(); k += std::max<std::size_t>(1, scene.points.size() / 1000))
        chosen.push_back(static_cast<std::uint32_t>(k));
    const PointSet sample = scene.points.select(chosen);
    ++scene.options.frame;
    scene.options.time = static_cast<double>(scene.options.frame) * scene.options.h;
    const std::uint64_t before = queries;
    solve_within(scene.points, scene.dynamics, scene.options, tolerance, most);
    work.in_run = queries - before;
    const std::uint64_t beyond_tolerance =
        check.beyond_tolerance(sample, scene.points, scene.dynamics, scene.options, tolerance, most);
    work.in_check = queries - before - work.in_run;
    return beyond_tolerance;
}

TEST_CASE("the check of a tolerance is made in the first four steps and every fourth, of a few points", "[tolerance]")
{
    std::atomic<std::uint64_t> queries = 0;
    Scene scene(line_of(20000));
    scene.force([&](const Chunk& chunk, std::size_t i) {
        ++queries;
        return Vec3d(0, 40 * std::cos(3 * chunk.P[i].y() + chunk.P[i].x()), 0);
    });
    ToleranceCheck check;
    Work work;
    std::uint64_t in_runs = 0, in_checks = 0;
    for (int k = 0; k < 24; ++k) {
        CAPTURE(k);
        CHECK(step(scene, check, queries, work) == 0);
        CHECK((work.in_check > 0) == (k < 4 || k % 4 == 0));
        if (k < 4) continue;
        in_runs += work.in_run;
        in_checks += work.in_check;
    }
    CAPTURE(in_runs, in_checks);
    CHECK(50 * in_checks < in_runs);  // 2 %
}

TEST_CASE("the check of a tolerance finds a force that halved steps meet at one phase, between checks too",
          "[tolerance]")
{
    std::atomic<std::uint64_t> queries = 0;
    Scene scene(line_of(2000));
    const double wave = 2 * M_PI * 24 * 4;  // for frames of 1/24 s: zero at the middles of one and two substeps
    scene.force([&](const Chunk& chunk, std::size_t i) {
        return Vec3d(chunk.P[i].x() < 0.05 ? 0 : 1000 * std::sin(wave * chunk.time[i]), 0, 0);
    });
    ToleranceCheck check;
    Work work;
    for (int k = 0; k < 6; ++k) {
        CAPTURE(k);
        // A quarter of the line has no force.
        CHECK(static_cast<double>(step(scene, check, queries, work)) == Approx(1500).margin(20));
    }
}

}  // namespace
}  // namespace rapid

#include "runtime/solver/estimate/shadow.h"

#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "tests/test.h"

using namespace rapid;

namespace {

PointSet points_with_ids(std::int64_t first, std::int64_t last)
{
    PointSet points;
    points.append(static_cast<std::size_t>(last - first));
    const auto ids = points.id().write();
    std::iota(ids.begin(), ids.end(), first);
    return points;
}

// A solver that moves every point by `way` metres.
auto by(float way)
{
    return [way](PointSet& points) {
        for (Vec3f& P : points.P().write()) P.x() += way;
    };
}

std::vector<double> shadow_frame(Shadows& shadows, PointSet& points, float way, float finer_way)
{
    shadows.begin(points, false);
    by(way)(points);
    return shadows.advance(points, by(finer_way));
}

// The same for an exact frame: the finer solver would find the same result.
std::vector<double> exact_frame(Shadows& shadows, PointSet& points, float way, int& solved)
{
    shadows.begin(points, true);
    by(way)(points);
    return shadows.advance(points, [&](PointSet& set) {
        ++solved;
        by(way)(set);
    });
}

}  // namespace

TEST_CASE("errors of frames accumulate from a point's birth on", "[shadow]")
{
    Shadows shadows;
    PointSet points = points_with_ids(0, 10);
    for (int f = 1; f <= 4; ++f) {
        const std::vector<double> errors = shadow_frame(shadows, points, 1, 1.25f);
        CHECK(errors == std::vector<double>(10, 2 * 0.25 * f));
    }
    // Points born now have had errors for one frame.
    PointSet both = points_with_ids(0, 13);
    std::copy_n(points.P().read().data, 10, both.P().write().begin());
    std::vector<double> errors = shadow_frame(shadows, both, 1, 1.25f);
    std::sort(errors.begin(), errors.end());
    CHECK(errors.front() == 0.5);
    CHECK(errors[2] == 0.5);
    CHECK(errors[3] == 2.5);
}

TEST_CASE("changes of a point by nodes between two frames are applied to its shadow", "[shadow]")
{
    Shadows shadows;
    PointSet points = points_with_ids(0, 3);
    shadow_frame(shadows, points, 1, 1.25f);
    for (Vec3f& P : points.P().write()) P += Vec3f(0, 7, -3);
    CHECK(shadow_frame(shadows, points, 1, 1).front() == 0.5);
}

TEST_CASE("of many points 1,000 to 1,250 have a shadow, the same ones in any order of birth", "[shadow]")
{
    Shadows shadows;
    PointSet points = points_with_ids(0, 900);
    CHECK(shadow_frame(shadows, points, 0, 0).size() == 900);
    points = points_with_ids(0, 50000);
    CHECK(shadow_frame(shadows, points, 0, 0).size() == 1000);
    for (std::int64_t n = 51000; n < 90000; n += 1000) {
        points = points_with_ids(0, n);
        const std::size_t size = shadow_frame(shadows, points, 0, 0).size();
        CHECK(size >= 1000);
        CHECK(size <= 1250);
    }
}

TEST_CASE("the shadow of a point dies with it, and stays with a point that moves within the set", "[shadow]")
{
    Shadows shadows;
    PointSet points = points_with_ids(0, 100);
    for (std::size_t i = 0; i < 100; ++i) points.P().write()[i].y() = static_cast<float>(i);
    shadow_frame(shadows, points, 1, 1.5f);
    std::vector<std::uint8_t> keep(100, 1);
    keep[3] = keep[50] = keep[99] = 0;
    points.keep(keep);
    const std::size_t left = 97;
    std::vector<std::uint32_t> reversed(left);
    for (std::size_t i = 0; i < left; ++i) reversed[i] = static_cast<std::uint32_t>(left - 1 - i);
    points = points.select(reversed);
    CHECK(shadow_frame(shadows, points, 1, 1.5f) == std::vector<double>(left, 2.0));
}

TEST_CASE("points with shadows are found again wherever others die", "[shadow]")
{
    rc::prop("", [] {
        Shadows shadows;
        std::int64_t next = 3000;
        PointSet points = points_with_ids(0, next);
        shadow_frame(shadows, points, 0, 0);
        for (int f = 0; f < 4; ++f) {
            // Many points of one stretch die, few elsewhere.
            const auto first = *rc::gen::inRange<std::size_t>(0, points.size());
            const auto odds = *rc::gen::container<std::vector<int>>(points.size(), rc::gen::inRange(0, 10));
            std::vector<std::uint8_t> keep(points.size());
            for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = odds[i] >= (i >= first && i < first + 500 ? 8 : 1);
            std::set<std::int64_t> expected;
            for (const std::int64_t id : shadows.ids()) expected.insert(id);
            for (std::size_t i = 0; i < keep.size(); ++i)
                if (!keep[i]) expected.erase(points.id()[i]);
            points.keep(keep);
            shadow_frame(shadows, points, 0, 0);
            RC_ASSERT(std::set<std::int64_t>(shadows.ids().begin(), shadows.ids().end()) == expected);
            for (std::size_t k = 0; k < shadows.ids().size(); ++k)
                RC_ASSERT(points.id()[shadows.indices()[k]] == shadows.ids()[k]);
        }
    });
}

TEST_CASE("what a position loses by rounding is what is left of its way beyond whole spacings", "[shadow]")
{
    const float spacing = 0x1p-23f;  // of positions from 1 to 2
    const double h = 0.5, part = GENERATE(0.0, 0.25, -0.375);
    const int more = GENERATE(0, 3, -2);  // spacings due to something other than the velocity: a contact, a node
    CAPTURE(part, more);
    Shadows shadows;
    PointSet points = points_with_ids(0, 1);
    points.P().write()[0] = Vec3f(1.5f, 0, 0);
    points.v().write()[0] = Vec3f(static_cast<float>(part * spacing / h), 0, 0);
    const auto move = [&](PointSet& set) { set.P().write()[0].x() += static_cast<float>(more) * spacing; };
    shadows.begin(points, false, h);
    move(points);
    shadows.advance(points, move);
    CHECK(shadows.rounding(false) == Approx((std::abs(part) + 0.5) * spacing));
}

TEST_CASE("exact frames are not solved again while no shadow differs from its point", "[shadow]")
{
    Shadows shadows;
    PointSet points = points_with_ids(0, 20);
    int solved = 0;
    CHECK(exact_frame(shadows, points, 1, solved) == std::vector<double>{0});
    CHECK(solved == 0);
    // From here on, existing errors continue to be reported, including those of points born in between.
    CHECK(shadow_frame(shadows, points, 1, 1.25f) == std::vector<double>(20, 0.5));
    CHECK(exact_frame(shadows, points, 1, solved) == std::vector<double>(20, 0.5));
    CHECK(solved == 1);
    PointSet nobody;
    Shadows of_nobody;
    CHECK(exact_frame(of_nobody, nobody, 1, solved).empty());
}

// Which points the viewer shows of more than it may.
#include "bindings/view/frame_message.h"
#include "tests/test.h"

using namespace rapid;

namespace {

PointSet points_with_ids(const std::vector<std::int64_t>& ids)
{
    PointSet points;
    points.append(ids.size());
    points.id() = Column<std::int64_t>(std::span(ids));
    return points;
}

}  // namespace

TEST_CASE("of points above a number those are shown whose id is a multiple of a power of two")
{
    std::vector<std::int64_t> ids(100);
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
    const PointSet points = points_with_ids(ids);
    FrameWish wish;
    wish.most = 30;
    const ShownPoints shown = shown_points(points, wish);
    CHECK(shown.every == 4);
    REQUIRE(shown.count == 25);
    for (std::size_t k = 0; k < shown.count; ++k) CHECK(points.id()[shown[k]] == static_cast<std::int64_t>(4 * k));
}

TEST_CASE("of points that have one id, as files of others may have them, some are shown")
{
    FrameWish wish;
    for (const std::int64_t id : {std::int64_t{0}, INT64_MIN, std::int64_t{1}, std::int64_t{-1}})
        for (const std::size_t most : {0, 1, 7}) {
            wish.most = most;
            CHECK(shown_points(points_with_ids(std::vector<std::int64_t>(20, id)), wish).count <= most);
        }
}

// Which points the viewer shows of more than it may.
#include "bindings/view/frame_message.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// As a file of others has them.
SceneFrame points_with_ids(const std::vector<std::int64_t>& ids)
{
    const test::TemporaryFolder folder;
    std::string text = "id,Px,Py,Pz\n";
    for (const std::int64_t id : ids) text += std::to_string(id) + ",0,0,0\n";
    return test::good(SceneFrame::read(folder.write("points.csv", text)));
}

}  // namespace

TEST_CASE("of points above a number those are shown whose id is a multiple of a power of two")
{
    std::vector<std::int64_t> ids(100);
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
    const SceneFrame points = points_with_ids(ids);
    FrameWish wish;
    wish.most = 30;
    const ShownPoints shown = shown_points(points, wish);
    CHECK(shown.every == 4);
    REQUIRE(shown.count == 25);
    for (std::size_t k = 0; k < shown.count; ++k)
        CHECK(*points.column("id")->at<std::int64_t>(shown[k]) == static_cast<std::int64_t>(4 * k));
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

TEST_CASE("the numbers of texts are their places in the alphabet, among the points that are meant")
{
    const test::TemporaryFolder folder;
    const SceneFrame points = test::good(SceneFrame::read(folder.write(
        "points.csv",
        "id,Px,Py,Pz,vx,vy,vz,name\n0,0,0,0,3,4,0,\"pear\"\n1,0,0,0,0,0,0,\"apple\"\n2,0,0,0,0,0,2,\"pear\"\n"
        "3,0,0,0,0,0,0,\"fig\"\n")));
    CHECK(numbers_of(points, "name") == std::vector<float>{2, 0, 2, 1});
    const Places some = {0, 3};
    CHECK(numbers_of(points, "name", &some) == std::vector<float>{1, 0});
    CHECK(numbers_of(points, "speed") == std::vector<float>{5, 0, 2, 0});
    CHECK_THROWS_WITH(numbers_of(points, "heat"), "the points have no attribute \"heat\" here");
    CHECK_THROWS_WITH(numbers_of(points, "group:low"), "the points have no group \"low\" here");
}

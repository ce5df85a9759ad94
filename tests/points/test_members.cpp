#include "runtime/points/members.h"

#include "tests/test.h"

namespace rapid {

TEST_CASE("members are those of the group; of no name all points, of a group that is not there none", "[members]")
{
    const PointSet set = test::points({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}).group("ends", {0, 2});
    const auto members = [&](std::string_view group) {
        const Strided<std::uint8_t> of = members_of(set, group);
        return std::vector<int>{of[0], of[1], of[2]};
    };
    CHECK(members("ends") == std::vector<int>{1, 0, 1});
    CHECK(members("") == std::vector<int>{1, 1, 1});
    CHECK(members("nobody") == std::vector<int>{0, 0, 0});
}

}  // namespace rapid

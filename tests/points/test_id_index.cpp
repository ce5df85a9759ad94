#include "runtime/points/id_index.h"

#include "tests/test.h"

namespace rapid {
namespace {

TEST_CASE("a point is found by its id, however the ids are ordered", "[points]")
{
    const std::vector<std::int64_t> ids =
        GENERATE(std::vector<std::int64_t>{}, std::vector<std::int64_t>{7, 8, 9, 10},
                 std::vector<std::int64_t>{-3, 2, 5, 11}, std::vector<std::int64_t>{9, 4, INT64_MAX, INT64_MIN});
    const Column<std::int64_t> column(ids);
    const IdIndex index(column);
    for (std::size_t i = 0; i < ids.size(); ++i) CHECK(index[ids[i]] == i);
    for (const std::int64_t absent : {-4, 0, 3, 6, 12}) CHECK(index[absent] == IdIndex::none);
}

}  // namespace
}  // namespace rapid

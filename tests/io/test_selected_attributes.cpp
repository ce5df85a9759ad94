#include "runtime/io/selected_attributes.h"

#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("selected attributes are P, v, id and the named ones, groups too", "[io][selected]")
{
    const PointSet points = random_points({.size = 5});

    const PointSet selected = select_attributes(points, {"age", "hot"});

    CHECK(selected.column_names() == std::vector<std::string>{"P", "age", "id", "v"});
    CHECK(selected.group_names() == std::vector<std::string>{"hot"});
    CHECK(error_of([&] { select_attributes(points, {"agee"}); }) ==
          "there is no attribute or group \"agee\" to write; did you mean \"age\"?");
}

// Arrays in blocks of pages.
#include "runtime/points/cell_grid.h"

#include <algorithm>
#include <numeric>

#include "tests/test.h"

namespace rapid {

TEST_CASE("an array keeps its values as it grows, and a copy has values of its own", "[pages]")
{
    const std::size_t size = GENERATE(0, 3, 100000);
    PageArray<int> values(size);
    std::iota(values.begin(), values.end(), 0);
    PageArray<int> copy = values;
    values.resize(3 * size);
    for (std::size_t i = 0; i < size; ++i) values[i] += copy[i];
    CHECK(values.size() == 3 * size);
    CHECK(copy.size() == size);
    CHECK(copy.empty() == (size == 0));
    for (std::size_t i = 0; i < size; ++i) REQUIRE((copy[i] == static_cast<int>(i) && values[i] == 2 * copy[i]));
    values = copy;
    CHECK(std::equal(values.begin(), values.end(), copy.begin(), copy.end()));
}

TEST_CASE("an array beyond any memory is refused", "[pages]")
{
    PageArray<double> values;
    CHECK_THROWS_AS(values.resize(~std::size_t{0} / 2), std::bad_alloc);
}

}  // namespace rapid

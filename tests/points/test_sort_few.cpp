// Short lists of numbers, sorted by rank.
#include "runtime/points/sort_few.h"

#include <algorithm>
#include <random>
#include <vector>

#include "tests/test.h"

namespace rapid {

TEST_CASE("lists of any length are sorted, and the memory after them is untouched", "[sort]")
{
    std::mt19937 random(3);
    for (std::uint32_t count = 0; count <= 2 * max_sorted_by_rank; ++count) {
        CAPTURE(count);
        std::vector<std::uint32_t> from(count + max_sorted_by_rank, 0), to(count + 1, 7), expected;
        for (std::uint32_t k = 0; k < count; ++k) expected.push_back(k * 0x9e3779b9u);  // distinct, 0 to 2^32
        std::shuffle(expected.begin(), expected.end(), random);
        std::copy(expected.begin(), expected.end(), from.begin());
        std::sort(expected.begin(), expected.end());
        sort_few(from.data(), count, to.data());
        CHECK(to.back() == 7);
        to.pop_back();
        CHECK(to == expected);
    }
}

}  // namespace rapid

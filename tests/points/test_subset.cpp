#include "runtime/points/subset.h"

#include <rapidcheck.h>

#include <cmath>

#include "tests/test.h"

namespace rapid {
namespace {

TEST_CASE("each point is in exactly one of the parts", "[subset]")
{
    CHECK(rc::check([] {
        const int count = *rc::gen::inRange(1, 100);
        const auto id = *rc::gen::arbitrary<std::int64_t>();
        int in = 0;
        for (int k = 1; k <= count; ++k) in += Subset(k, count).has(id);
        RC_ASSERT(in == 1);
        const auto own = static_cast<int>(Subset::part_of(id, static_cast<std::uint64_t>(count)));
        RC_ASSERT(Subset(own + 1, count).has(id));
    }));
}

TEST_CASE("a smaller sample is a part of a larger one", "[subset]")
{
    CHECK(rc::check([] {
        const double larger = *rc::gen::inRange(1, 1000) / 1000.0,
                     smaller = larger * *rc::gen::inRange(1, 1000) / 1000.0;
        const auto id = *rc::gen::arbitrary<std::int64_t>();
        RC_ASSERT(!Subset(1, 1, smaller).has(id) || Subset(1, 1, larger).has(id));
    }));
}

// The size of a sample of n independent draws with probability f: n f ± 5 √(n f (1 - f)).
TEST_CASE("parts and samples are as large as they should be, also parts of samples", "[subset]")
{
    const auto [count, fraction] = GENERATE(table<int, double>({{2, 1}, {16, 1}, {1, 0.01}, {16, 0.1}, {3, 0.5}}));
    const int n = 1'000'000;
    const double share = fraction / count, width = 5 * std::sqrt(n * share * (1 - share));
    for (int k = 1; k <= count; ++k) {
        const Subset subset(k, count, fraction);
        int in = 0;
        for (int id = 0; id < n; ++id) in += subset.has(id);
        CHECK(std::abs(in - n * share) < width);
    }
}

// Consecutive births are in the same part no more often than any other two, so a preview has no clumps.
TEST_CASE("neighbours in id are in parts independently", "[subset]")
{
    const int n = 1'000'000;
    const Subset subset(1, 1, 0.1);
    int both = 0;
    for (int id = 0; id < n; ++id) both += subset.has(id) && subset.has(id + 1);
    CHECK(std::abs(both - n * 0.01) < 5 * std::sqrt(n * 0.01));
}

TEST_CASE("all points are in the only part, and in a sample of all", "[subset]")
{
    CHECK(Subset().is_all());
    CHECK(Subset(1, 1, 1.0).is_all());
    CHECK(!Subset(1, 2).is_all());
    CHECK(!Subset(1, 1, 0.999).is_all());
    for (const std::int64_t id : {INT64_MIN, std::int64_t{-1}, std::int64_t{0}, INT64_MAX}) CHECK(Subset().has(id));
}

}  // namespace
}  // namespace rapid

#include "runtime/base/memory_watch.h"

#include <malloc.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <thread>
#include <vector>

#include "runtime/base/memory_budget.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Matchers::Contains;

struct Reported {
    std::atomic<int> exceeded = 0, overrun = 0;
    std::string message;

    bool waits_for(const std::atomic<int>& count) const
    {
        for (int i = 0; i < 4000 && count == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        return count != 0;
    }
};

// Allocates this many MiB while the memory is watched. With `leave`, stops when it is asked to end.
void take(Reported& reported, std::size_t mebibytes, bool leave)
{
    malloc_trim(0);  // releases memory that other tests freed, which the watch would do otherwise
    const MemoryWatch watch(
        MemoryWatch::now(),
        [&](const Error& error) {
            reported.message = error.message();
            ++reported.exceeded;
        },
        [&](const Error&) { ++reported.overrun; });
    const std::vector<char> memory(mebibytes << 20, 1);
    if (leave)
        reported.waits_for(reported.exceeded);
    else
        reported.waits_for(reported.overrun);
}

}  // namespace

TEST_CASE("a run that exceeds its budget is requested to end, and once more if it does not", "[memory]")
{
    const MemoryBudget budget(1);
    Reported leaves, stays, grows;
    take(leaves, 130, true);
    CHECK(leaves.exceeded == 1);
    CHECK(leaves.overrun == 0);
    CHECK_THAT(leaves.message, Contains("the run uses") && Contains("or set memory"));
    take(stays, 130, false);
    CHECK(stays.exceeded == 1);
    CHECK(stays.overrun == 1);
    take(grows, 300, false);
    CHECK(grows.exceeded == 1);
    CHECK(grows.overrun == 1);
}

TEST_CASE("little memory is let pass whatever the budget", "[memory]")
{
    const MemoryBudget budget(1);
    int reported = 0;
    {
        const MemoryWatch watch(MemoryWatch::now(), [&](const Error&) { ++reported; }, {});
        const std::vector<char> memory(std::size_t{32} << 20, 1);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    CHECK(reported == 0);
}

TEST_CASE("memory is not watched without a budget", "[memory]")
{
    const auto threads = [] {
        const std::filesystem::directory_iterator all("/proc/self/task");
        return std::distance(begin(all), end(all));
    };
    REQUIRE_FALSE(is_memory_limited());
    const auto before = threads();
    {
        const MemoryWatch none(MemoryWatch::now(), {}, {});
        CHECK(threads() == before);
    }
    const MemoryBudget budget(1);
    const MemoryWatch one(MemoryWatch::now(), {}, {});
    CHECK(threads() == before + 1);
}

}  // namespace rapid

// Checks that each thread gets its own values, and the order of their destruction.
#include "runtime/base/per_thread.h"

#include <new>
#include <string>
#include <thread>
#include <vector>

#include "tests/test.h"

namespace rapid {
namespace {

std::string destroyed;  // names, in order

struct Named {
    ~Named() { destroyed += name; }
    std::string name;
};

bool is_refused = false;

struct Refused {
    Refused()
    {
        if (is_refused) throw std::bad_alloc();
    }
    int number = 7;
};

std::vector<int>& numbers()
{
    thread_local PerThread<std::vector<int>> kept;
    return *kept;
}

TEST_CASE("a value of a thread keeps what that thread put there, and no other thread sees it", "[threads]")
{
    numbers() = {1, 2, 3};
    std::vector<int> before, after;
    std::thread([&] {
        before = numbers();
        numbers().push_back(4);
        after = numbers();
    }).join();
    CHECK(before.empty());
    CHECK(after == std::vector<int>{4});
    CHECK(numbers() == std::vector<int>{1, 2, 3});
}

TEST_CASE("the values of a thread are destroyed when it ends, the latest first")
{
    destroyed.clear();
    std::thread([] {
        thread_local PerThread<Named> first, second;
        [[maybe_unused]] thread_local PerThread<Named> never;
        (*first).name = "1";
        (*second).name = "2";
    }).join();
    CHECK(destroyed == "21");
}

TEST_CASE("a value whose construction fails is an error, and is constructed at the next request")
{
    thread_local PerThread<Refused> kept;
    is_refused = true;
    CHECK_THROWS_AS(*kept, std::bad_alloc);
    is_refused = false;
    CHECK((*kept).number == 7);
}

}  // namespace
}  // namespace rapid

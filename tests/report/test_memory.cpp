#include <cstring>
#include <memory>

#include "runtime/report/memory.h"
#include "tests/test.h"

using namespace rapid;

TEST_CASE("the peak is at least the memory touched at once, and stays when that is given back", "[report]")
{
    constexpr std::size_t size = std::size_t{96} << 20;
    {
        const auto block = std::make_unique<volatile char[]>(size);
        for (std::size_t i = 0; i < size; i += 4096) block[i] = 1;
    }
    const std::uint64_t peak = peak_memory();
    CHECK(peak >= size);
    CHECK(peak_memory() >= peak);
}

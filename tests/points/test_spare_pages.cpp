#include "runtime/points/spare_pages.h"

#include <sys/mman.h>

#include <set>

#include "tests/test.h"

namespace rapid {
namespace {

constexpr std::size_t mib = std::size_t{1} << 20;

SparePages::Block mapped(std::size_t bytes)
{
    return {mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), bytes};
}

// Takes blocks of this size until there are none left, and returns their number.
std::size_t take_all(SparePages& pages, std::size_t bytes)
{
    std::size_t count = 0;
    for (SparePages::Block block = pages.take(bytes); block.begin; block = pages.take(bytes), ++count)
        munmap(block.begin, block.bytes);
    return count;
}

}  // namespace

TEST_CASE("pages of all columns of a frame are reused in the next", "[spare_pages]")
{
    SparePages pages;
    pages.keep(12);
    std::set<void*> given, taken;
    for (std::size_t k = 0; k < 12; ++k) {
        const SparePages::Block block = mapped(mib + 4096 * k);
        given.insert(block.begin);
        pages.give(block);
    }
    for (std::size_t k = 0; k < 12; ++k) {
        const SparePages::Block block = pages.take(mib + 4096 * k);
        CHECK(block.bytes == mib + 4096 * k);
        taken.insert(block.begin);
        munmap(block.begin, block.bytes);
    }
    CHECK(taken == given);
    CHECK(!pages.take(mib).begin);
}

TEST_CASE("room is whole pages, at most a quarter more than what is asked for, and none more for what is not kept",
          "[spare_pages]")
{
    for (std::size_t bytes = 1; bytes < 17 * mib; bytes += 999 + bytes / 7) {
        const std::size_t room = SparePages::room_for(bytes);
        CHECK(room >= bytes);
        CHECK(room <= bytes + std::max<std::size_t>(bytes / 4, 4095));
        CHECK((room % 4096 == 0 || room == bytes));
    }
    CHECK(SparePages::room_for(17 * mib + 1) == 17 * mib + 1);
}

TEST_CASE("of more pages than are kept those that came first go back to the system", "[spare_pages]")
{
    SparePages few(3);
    for (std::size_t k = 1; k <= 5; ++k) few.give(mapped(k * 3 * mib));
    CHECK(take_all(few, 6 * mib) + take_all(few, 3 * mib) == 2);  // 9 and 12 MiB; 15 MiB is too large for either
    CHECK(take_all(few, 15 * mib) == 1);

    SparePages many(100);
    for (int k = 0; k < 100; ++k) many.give(mapped(2 * mib));
    CHECK(take_all(many, 2 * mib) == 32);  // 64 MiB

    SparePages large(100);
    large.give(mapped(17 * mib));
    CHECK(take_all(large, 17 * mib) == 0);
}

}  // namespace rapid

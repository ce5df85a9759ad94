#include <sys/mman.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <numeric>
#include <set>
#include <span>

#include "runtime/points/buffer.h"
#include "tests/test.h"

namespace rapid {
namespace {

std::span<std::uint64_t> words(const Buffer& buffer, std::size_t bytes)
{
    return {static_cast<std::uint64_t*>(buffer.data()), bytes / sizeof(std::uint64_t)};
}

std::uintptr_t address(const Buffer& buffer) { return reinterpret_cast<std::uintptr_t>(buffer.data()); }

}  // namespace

TEST_CASE("values survive growth, from the heap to pages and from pages to more pages", "[buffer]")
{
    Buffer buffer;
    std::size_t written = 0;
    // 64 B to 64 MiB: blocks come from the heap below 256 KiB, and are separate pages from there on.
    for (std::size_t bytes = 64; bytes <= std::size_t{1} << 26; bytes *= 4) {
        buffer.reserve(bytes);
        REQUIRE(buffer.capacity() >= bytes);

        const auto values = words(buffer, bytes);
        for (std::size_t i = 0; i < written; ++i)
            if (values[i] != i) FAIL("value " << i << " is " << values[i] << " at " << bytes << " bytes");
        std::iota(values.begin(), values.end(), std::uint64_t{0});
        written = values.size();
    }
}

TEST_CASE("room that is there already is kept where it is", "[buffer]")
{
    Buffer buffer(1000);
    void* before = buffer.data();
    buffer.reserve(10);
    buffer.reserve(buffer.capacity());
    CHECK(buffer.data() == before);
}

TEST_CASE("bytes that are given up can be taken back, and what is behind them stays as the block grows", "[buffer]")
{
    const std::size_t bytes = GENERATE(std::size_t{1} << 12, std::size_t{1} << 20);  // from the heap; from pages
    Buffer buffer(bytes);
    const auto values = words(buffer, bytes);
    std::iota(values.begin(), values.end(), std::uint64_t{0});
    const std::uintptr_t before = address(buffer);
    const std::size_t room = buffer.capacity();

    buffer.give_up(120);
    CHECK(address(buffer) == before + 120);
    CHECK(buffer.capacity() == room - 120);
    CHECK(buffer.given_up() >= 120);
    CHECK(buffer.given_up() < 120 + 4096);
    buffer.reserve(8 * bytes);
    CHECK(words(buffer, bytes)[0] == 15);
    CHECK(words(buffer, bytes - 120).back() == bytes / 8 - 1);
    buffer.take_back();
    CHECK(address(buffer) % 64 == 0);
    CHECK(buffer.capacity() >= 8 * bytes);
    std::memset(buffer.data(), 1, buffer.capacity());

    Buffer other(bytes);
    const std::uintptr_t begin = address(other);
    other.give_up(bytes);
    other.take_back();
    CHECK(address(other) / 4096 == begin / 4096);
    CHECK(other.capacity() >= bytes);

    Buffer none(0);
    CHECK(none.given_up() == 0);
    none.take_back();
    CHECK(none.capacity() == 0);
}

TEST_CASE("buffers of one size take each other's pages, wherever they begin in them", "[buffer]")
{
    constexpr std::size_t bytes = 12'000'000;
    std::uintptr_t first = 0;
    for (int k = 0; k < 64; ++k) {
        const Buffer buffer(bytes);
        if (k == 0) first = address(buffer) / 4096;
        REQUIRE(address(buffer) / 4096 == first);
    }
}

TEST_CASE("pages that are given back serve the next of about their size, and no other", "[buffer]")
{
    const std::size_t bytes = std::size_t{5} << 20;
    std::uintptr_t before = 0;
    {
        Buffer buffer(bytes);
        before = address(buffer) / 4096;
    }
    const Buffer larger(3 * bytes), smaller(bytes / 3);
    CHECK(address(larger) / 4096 != before);
    CHECK(address(smaller) / 4096 != before);
    const Buffer same(bytes - 100), other(bytes);
    CHECK(address(same) / 4096 == before);
    CHECK(same.capacity() >= bytes - 100);
    CHECK(address(other) / 4096 != before);
    std::memset(same.data(), 1, same.capacity());
    std::memset(other.data(), 2, other.capacity());
    CHECK(static_cast<char*>(same.data())[same.capacity() - 1] == 1);
}

TEST_CASE("buffers that are each a little larger than the one before mostly take its pages", "[buffer]")
{
    std::size_t bytes = 3'000'000, others = 0, count = 0;
    std::uintptr_t before = 0;
    for (; bytes < 12'000'000; bytes += bytes / 50, ++count) {
        const Buffer buffer(bytes);
        others += address(buffer) / 4096 != before;
        before = address(buffer) / 4096;
    }
    CHECK(count > 60);
    CHECK(others <= 9);  // two doublings in steps of an eighth to a quarter, plus the first block
}

TEST_CASE("growing bit by bit moves the values a few times, not every time", "[buffer]")
{
    Buffer buffer;
    std::set<std::size_t> capacities;
    for (std::size_t bytes = 1; bytes < 1000000; bytes += 100) {
        buffer.reserve(bytes);
        capacities.insert(buffer.capacity());
    }
    CHECK(capacities.size() < 40);  // log(1e6) / log(1.5) = 34, plus the change from heap to pages
}

TEST_CASE("every block starts on a cache line", "[buffer]")
{
    const std::size_t bytes = GENERATE(1, 100, 5000, 1 << 18, (1 << 20) + 1);
    for (int i = 0; i < 100; ++i) CHECK(address(Buffer(bytes)) % 64 == 0);
}

TEST_CASE("an empty block has an address, and is freed like others", "[buffer]")
{
    Buffer none(0);
    CHECK(none.data() != nullptr);
    CHECK(none.capacity() == 0);
    Buffer moved = std::move(none);
    moved.reserve(3);
    CHECK(moved.capacity() >= 3);
}

TEST_CASE("large blocks start at different places of their pages", "[buffer]")
{
    std::set<std::uintptr_t> offsets;
    for (int i = 0; i < 10; ++i) offsets.insert(address(Buffer(1 << 20)) % 4096);
    CHECK(offsets.size() == 10);
}

TEST_CASE("moving a buffer moves the block, and the values of neither are lost", "[buffer]")
{
    const std::size_t bytes = GENERATE(64, 1 << 20);
    Buffer from(bytes), to(128);
    words(from, bytes)[7] = 42;
    void* block = from.data();

    to = std::move(from);
    CHECK(to.data() == block);
    CHECK(words(to, bytes)[7] == 42);

    from.reserve(bytes);  // a moved-from buffer is empty and usable
    CHECK(from.data() != block);
}

TEST_CASE("more memory than there is address space is refused, before anything changes", "[buffer]")
{
    Buffer buffer(64);
    words(buffer, 64)[0] = 42;
    const std::size_t bytes =
        GENERATE(as<std::size_t>{}, std::size_t{1} << 60, ~std::size_t{0}, ~std::size_t{0} - 4096);

    CHECK_THROWS_AS(buffer.reserve(bytes), std::bad_alloc);

    CHECK(buffer.capacity() == 64);
    CHECK(words(buffer, 64)[0] == 42);
}

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

#include "runtime/math/random.h"

#include "runtime/math/items.h"
#include "tests/test.h"

namespace rapid {
namespace {

RandomKey key_of(std::uint64_t value)
{
    RandomKey key;
    key.value = value;
    return key;
}

}  // namespace

TEST_CASE("the numbers are Philox4x32-10, as its authors publish them", "[random]")
{
    struct Known {
        std::uint64_t item, use, key;
        std::array<std::uint32_t, 4> bits;
    };
    // From kat_vectors of Random123. Counters and keys are given low word first.
    const auto known = GENERATE(Known{0, 0, 0, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
                                Known{~0ull, ~0ull, ~0ull, {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
                                Known{0x85a308d3243f6a88,
                                      0x0370734413198a2e,
                                      0x299f31d0a4093822,
                                      {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}});

    const auto numbers = uniform4(key_of(known.key), known.item, known.use);

    for (std::size_t i = 0; i < 4; ++i) CHECK(numbers[i] * 4294967296.0 == known.bits[i]);
}

TEST_CASE("a number is at least 0 and below 1", "[random]")
{
    rc::prop("any key, item and use", [](std::uint64_t key, std::uint64_t item, std::uint64_t use) {
        for (const double number : uniform4(key_of(key), item, use)) RC_ASSERT((number >= 0 && number < 1));
    });
}

TEST_CASE("the numbers of many items are spread evenly, and the four of an item are independent", "[random]")
{
    constexpr int items = 40000;
    const RandomKey key(7, "emit1");
    std::array<double, 4> sum{}, squares{};
    double product = 0;
    for (int item = 0; item < items; ++item) {
        const auto numbers = uniform4(key, item, 0);
        for (std::size_t i = 0; i < 4; ++i) {
            sum[i] += numbers[i];
            squares[i] += numbers[i] * numbers[i];
        }
        product += (numbers[0] - 0.5) * (numbers[1] - 0.5);
    }

    // Five standard deviations of the mean of 40,000 values: 0.29 for a uniform number, 0.30 for its square, 1/12 for a
    // product of two centred ones.
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(sum[i] / items == Approx(1.0 / 2).margin(5 * 0.29 / 200));
        CHECK(squares[i] / items == Approx(1.0 / 3).margin(5 * 0.30 / 200));
    }
    CHECK(product / items == Approx(0).margin(5.0 / 12 / 200));
}

TEST_CASE("seed, node, item and use each give other numbers, and the same give the same", "[random]")
{
    const auto numbers = uniform4(RandomKey(7, "emit1"), 3, 1);

    CHECK(uniform4(RandomKey(7, "emit1"), 3, 1) == numbers);
    CHECK(uniform4(RandomKey(8, "emit1"), 3, 1) != numbers);
    CHECK(uniform4(RandomKey(7ull + (1ull << 32), "emit1"), 3, 1) != numbers);
    CHECK(uniform4(RandomKey(7, "emit2"), 3, 1) != numbers);
    CHECK(uniform4(RandomKey(7, "emit1"), 4, 1) != numbers);
    CHECK(uniform4(RandomKey(7, "emit1"), 3, 2) != numbers);
}

TEST_CASE("a scene drawn today is drawn the same by the next version", "[random]")
{
    // Philox of {0, 0, 0, 0} with the 64-bit FNV-1a hash of "" as key, computed with Random123 only.
    r123::Philox4x32 philox;
    const auto mixed = philox({{0, 0, 0, 0}}, {{0x84222325, 0xcbf29ce4}});
    CHECK(RandomKey(0, "").value == (mixed[0] | std::uint64_t{mixed[1]} << 32));
}

TEST_CASE("numbers drawn side by side are bit-identical to those drawn one by one", "[random]")
{
    const RandomKey key(7, "emit1");
    const std::uint64_t first = 0xFFFFFFF0, use = GENERATE(std::uint64_t{0}, std::uint64_t{5} << 32 | 16);
    std::vector<std::array<double, 4>> together(41);
    uniform4(key, first, use, together);
    for (std::size_t i = 0; i < together.size(); ++i) CHECK(together[i] == uniform4(key, first + i, use));
}

TEST_CASE("numbers of some items are those of each, however many there are", "[random]")
{
    const RandomKey key(7, "emit1");
    std::vector<std::uint32_t> offsets;
    for (std::uint32_t i = 0; offsets.size() < 100; i += 1 + i % 7) offsets.push_back(i);
    const std::uint64_t first = 0xFFFFFFF0;  // the items cross a carry into the high half of the counter
    for (const std::size_t n : {0, 1, 15, 16, 17, 100}) {
        std::vector<std::array<double, 4>> numbers(n);
        uniform4(key, Items(first, offsets.data()), 3, numbers);
        for (std::size_t i = 0; i < n; ++i) CHECK(numbers[i] == uniform4(key, first + offsets[i], 3));
    }
    CHECK(Items(first, offsets.data()).from(5)[2] == first + offsets[7]);
    CHECK(Items(4).from(5)[2] == 11);
}

TEST_CASE("a number of 53 bits is made of two of 32, for any items side by side", "[random]")
{
    const RandomKey key(7, "points1");
    const std::uint64_t use = std::uint64_t{5} << 32 | 16;
    for (const std::size_t n : {0, 1, 7, 15, 16, 17, 130}) {
        std::vector<std::uint64_t> items(n);
        for (std::size_t i = 0; i < n; ++i) items[i] = i * i * 0x9E3779B97F4A7C15;
        std::vector<double> numbers(n);
        uniform53(key, items, use, numbers);
        for (std::size_t i = 0; i < n; ++i) {
            const auto parts = uniform4(key, items[i], use);
            CHECK(numbers[i] == parts[0] + parts[1] * 0x1p-32);
            CHECK(numbers[i] == uniform53(key, items[i], use));
        }
    }
}

}  // namespace rapid

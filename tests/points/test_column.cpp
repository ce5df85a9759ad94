#include "runtime/points/column.h"

#include <atomic>
#include <numeric>
#include <thread>

#include "tests/test.h"

namespace rapid {
namespace {

template <class T>
std::vector<T> values_of(const Column<T>& column)
{
    std::vector<T> values;
    for (std::size_t i = 0; i < column.size(); ++i) values.push_back(column[i]);
    return values;
}

Column<float> column_of(const std::vector<float>& values) { return Column<float>(std::span(values)); }

// Returns a value of each type that is different for every i.
template <class T>
T value_of(int i)
{
    if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f(static_cast<float>(i), 0.5f, -1);
    else if constexpr (std::is_same_v<T, Quatf>)
        return Quatf(static_cast<float>(i), 0, 1, 2);
    else
        return static_cast<T>(i);
}

template <class T>
bool equal(const T& a, const T& b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}  // namespace

TEST_CASE("a value that all points share is held once", "[column]")
{
    Column<float> column(1000000, 0.02f);
    CHECK(column.is_uniform());
    CHECK(column.bytes() == 4);
    CHECK(column[999999] == 0.02f);
    CHECK(column.read().stride == 0);
}

TEST_CASE("a shared column that all points have left is written, and takes others", "[column]")
{
    // The undefined behaviour sanitizer reports a copy of zero values from a null pointer.
    Column<float> column = column_of({1, 2, 3});
    const Column<float> before = column;
    column.keep(Compaction::from_mask(std::vector<std::uint8_t>(3, 0)));
    const Column<float> left = column;
    CHECK(column.write().empty());
    const std::vector<float> added = {4};
    column.append(std::span(added));
    CHECK(values_of(column) == added);
    CHECK(left.size() == 0);
    CHECK(values_of(before) == std::vector{1.0f, 2.0f, 3.0f});
}

TEST_CASE("writing expands a uniform column into its value, everywhere", "[column]")
{
    Column<float> column(3, 0.02f);
    column.write()[1] = 5;
    CHECK(values_of(column) == std::vector{0.02f, 5.0f, 0.02f});
    CHECK(column.bytes() == 12);
}

TEST_CASE("a copy shares memory until one of the two is written", "[column]")
{
    Column<float> original = column_of({1, 2, 3});
    Column<float> copy = original;
    CHECK(copy.shares_values_with(original));

    copy.write()[0] = 9;

    CHECK_FALSE(copy.shares_values_with(original));
    CHECK(values_of(original) == std::vector{1.0f, 2.0f, 3.0f});
    CHECK(values_of(copy) == std::vector{9.0f, 2.0f, 3.0f});
}

TEST_CASE("a column that is alone is written in place", "[column]")
{
    Column<float> column = column_of({1, 2, 3});
    const float* before = column.read().data;
    column.write();
    column.overwrite();
    CHECK(column.read().data == before);
    {
        const Column<float> copy = column;
    }  // NOLINT: the column was shared and is now the only owner
    column.write();
    CHECK(column.read().data == before);
}

TEST_CASE("overwriting a shared column leaves the other's values", "[column]")
{
    Column<float> original = column_of({1, 2, 3});
    Column<float> copy = original;
    for (float& value : copy.overwrite()) value = 7;
    CHECK(values_of(original) == std::vector{1.0f, 2.0f, 3.0f});
    CHECK(values_of(copy) == std::vector{7.0f, 7.0f, 7.0f});
}

TEST_CASE("filling makes a column uniform again", "[column]")
{
    Column<float> column = column_of({1, 2, 3});
    column.fill(4);
    CHECK(column.is_uniform());
    CHECK(values_of(column) == std::vector{4.0f, 4.0f, 4.0f});
}

TEST_CASE("points that are appended without a value get the fallback", "[column]")
{
    Column<float> column = column_of({1});
    column.set_fallback(8);
    column.append(2);
    CHECK(values_of(column) == std::vector{1.0f, 8.0f, 8.0f});
}

TEST_CASE("a uniform column stays uniform while its own value is appended", "[column]")
{
    Column<float> column(2, 0.02f);
    column.append(3);
    column.append(1, 0.02f);
    CHECK(column.is_uniform());
    CHECK(column.size() == 6);

    column.append(1, 0.03f);
    CHECK_FALSE(column.is_uniform());
    CHECK(values_of(column) == std::vector{0.02f, 0.02f, 0.02f, 0.02f, 0.02f, 0.02f, 0.03f});
}

TEST_CASE("a column without points becomes uniform with its first", "[column]")
{
    Column<float> column;
    column.write();  // like a node that writes all points of an empty frame
    column.append(1000, 0.5f);
    CHECK(column.is_uniform());
    CHECK(column[999] == 0.5f);
}

TEST_CASE("zero and minus zero are two values, and NaN is one", "[column]")
{
    Column<float> column(1, 0.0f);
    column.append(1, -0.0f);
    CHECK(std::signbit(column[1]));

    Column<float> nan(1, std::numeric_limits<float>::quiet_NaN());
    nan.append(1, std::numeric_limits<float>::quiet_NaN());
    CHECK(nan.is_uniform());
}

TEST_CASE("a value of the column itself can be appended, though its memory moves", "[column]")
{
    Column<float> column = column_of(std::vector<float>(65536, 6.0f));  // beyond this, growth moves from heap to pages
    column.append(100000, column[17]);
    CHECK(column.size() == 165536);
    CHECK(column[165535] == 6.0f);
}

TEST_CASE("appending to a copy leaves the original", "[column]")
{
    const Column<float> original = column_of({1, 2});
    Column<float> copy = original;
    copy.append(1, 3);
    CHECK(values_of(original) == std::vector{1.0f, 2.0f});
    CHECK(values_of(copy) == std::vector{1.0f, 2.0f, 3.0f});
}

TEST_CASE("more values than memory can number are refused", "[column]")
{
    Column<Vec3f> column(std::size_t{1} << 60, Vec3f::Zero());
    CHECK_THROWS_AS(column.write(), std::bad_alloc);
    Column<Vec3f> huge(~std::size_t{0} / 4, Vec3f::Zero());  // its size in bytes is small modulo 2^64
    CHECK_THROWS_AS(huge.write(), std::bad_alloc);
}

TEST_CASE("a mask gives the runs of points that stay", "[column]")
{
    const auto runs_of = [](std::vector<std::uint8_t> mask) {
        std::vector<std::pair<std::size_t, std::size_t>> runs;
        for (const auto& run : Compaction::from_mask(mask).runs) runs.emplace_back(run.begin, run.size);
        return runs;
    };
    using Runs = std::vector<std::pair<std::size_t, std::size_t>>;
    CHECK(runs_of({}) == Runs{});
    CHECK(runs_of({0, 0}) == Runs{});
    CHECK(runs_of({1, 1, 1}) == Runs{{0, 3}});
    CHECK(runs_of({0, 1, 1, 0, 0, 1}) == Runs{{1, 2}, {5, 1}});
    CHECK(runs_of({0, 2, 255, 0}) == Runs{{1, 2}});  // any value but 0 keeps a point
}

TEST_CASE("the first of the longest runs is found, with the points that stay before it", "[column]")
{
    const auto longest_of = [](std::vector<std::uint8_t> mask) {
        const Compaction compaction = Compaction::from_mask(mask);
        return std::pair(compaction.longest, compaction.ahead);
    };
    using Longest = std::pair<std::size_t, std::size_t>;
    CHECK(longest_of({1, 1, 1}) == Longest{0, 0});
    CHECK(longest_of({0, 1, 0, 1, 1, 0, 1, 1}) == Longest{1, 1});
    CHECK(longest_of({1, 1, 0, 1, 0, 1, 1, 1}) == Longest{2, 3});
}

TEST_CASE("the longest run of the points that stay is not moved", "[column]")
{
    std::vector<float> values(1000);
    std::iota(values.begin(), values.end(), 0.0f);
    Column<float> column = column_of(values);
    const float* const young = &std::as_const(column)[200];
    std::vector<std::uint8_t> mask(values.size(), 1);
    for (const std::size_t dead : {0, 3, 199, 900, 999}) mask[dead] = 0;
    column.keep(Compaction::from_mask(mask));
    std::erase_if(values, [&](float value) { return !mask[static_cast<std::size_t>(value)]; });
    CHECK(values_of(column) == values);
    CHECK(&std::as_const(column)[197] == young);
}

TEST_CASE("a column whose oldest points die while others are born stays where it is, within a quarter", "[column]")
{
    // Removes 1/64 per round. If the room before the values were never reused, it would grow to 64 times the size.
    const std::size_t size = GENERATE(std::size_t{1} << 12, std::size_t{1} << 17), dead = size / 64;  // heap; pages
    Column<std::int64_t> column;
    std::int64_t next = 0;
    const auto bear = [&](std::size_t n) {
        for (std::int64_t& value : column.append_for_writing(n)) value = next++;
    };
    bear(size + dead);
    std::vector<std::uint8_t> mask(size + dead, 1);
    std::fill_n(mask.begin(), dead, std::uint8_t{0});
    std::size_t moved = 0;  // number of times that the block of memory changed
    const std::int64_t *begin = nullptr, *end = nullptr;
    for (std::int64_t round = 0; round < 1000; ++round) {
        column.keep(Compaction::from_mask(mask));
        const std::int64_t* const first = &std::as_const(column)[0];
        REQUIRE(*first == (round + 1) * static_cast<std::int64_t>(dead));
        REQUIRE(first[size - 1] == next - 1);
        if (first < begin || first >= end) ++moved, begin = first, end = first + size / 4 + 1;
        bear(dead);
    }
    CHECK(moved <= 3);
}

TEMPLATE_TEST_CASE("a column of any type does what a vector does", "[column]", float, Vec3f, std::int32_t, std::int64_t,
                   Quatf, std::uint8_t)
{
    using T = TestType;
    // Applies random edits to a column and to a model. Every second edit copies the column first, and the copy must not
    // change.
    rc::prop("appending, writing, filling and removing", [] {
        Column<T> column(0, value_of<T>(3));
        std::vector<T> model;
        const auto edits = *rc::gen::container<std::vector<std::pair<int, int>>>(
            rc::gen::pair(rc::gen::inRange(0, 7), rc::gen::inRange(0, 200)));
        for (const auto& [edit, n] : edits) {
            const Column<T> copy = n % 2 ? column : Column<T>();
            const std::vector<T> copied = values_of(copy);
            const auto count = static_cast<std::size_t>(n);
            if (edit == 0) {
                column.append(count);
                model.insert(model.end(), count, value_of<T>(3));
            } else if (edit == 1) {
                column.append(count, value_of<T>(n));
                model.insert(model.end(), count, value_of<T>(n));
            } else if (edit == 2) {
                const std::vector<T> added(count, value_of<T>(n + 1));
                column.append(std::span(added));
                model.insert(model.end(), added.begin(), added.end());
            } else if (edit == 3 && !model.empty()) {
                column.write()[count % model.size()] = value_of<T>(n);
                model[count % model.size()] = value_of<T>(n);
            } else if (edit == 4) {
                column.fill(value_of<T>(n));
                model.assign(model.size(), value_of<T>(n));
            } else if (edit >= 5) {
                // Removes many of all points, or a few that are mostly among the first.
                std::vector<std::uint8_t> mask(model.size());
                for (std::size_t i = 0; i < mask.size(); ++i)
                    mask[i] = edit == 5 ? (i * 7 + count) % 3 != 0 : i % 5 != 0 || (i > count / 2 && i % 64 != 0);
                column.keep(Compaction::from_mask(mask));
                std::vector<T> kept;
                for (std::size_t i = 0; i < mask.size(); ++i)
                    if (mask[i]) kept.push_back(model[i]);
                model = kept;
            }
            const std::vector<T> now = values_of(column);
            RC_ASSERT(now.size() == model.size());
            RC_ASSERT(std::equal(now.begin(), now.end(), model.begin(), equal<T>));
            const std::vector<T> copied_now = values_of(copy);
            RC_ASSERT(std::equal(copied.begin(), copied.end(), copied_now.begin(), copied_now.end(), equal<T>));
        }
    });
}

TEST_CASE("a column is written in place only after a reader in another thread has let go of it", "[column][threads]")
{
    // The thread sanitizer reports an error if releasing the copy does not order its reads before the writes.
    Column<float> column = column_of(std::vector<float>(1000, 1.0f));
    std::atomic<bool> wrong = false;
    for (int round = 0; round < 50; ++round) {
        std::thread reader([copy = column, expected = column[0], &wrong]() mutable {
            for (std::size_t i = 0; i < copy.size(); ++i)
                if (copy[i] != expected) wrong = true;
            copy = Column<float>();
        });
        for (float& value : column.write()) value += 1;
        for (float& value : column.write()) value += 1;
        reader.join();
    }
    CHECK_FALSE(wrong);
    CHECK(column[999] == 101);
}

}  // namespace rapid
